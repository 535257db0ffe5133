"""`doctor`: an answer per check, an exit code that says what the answers say."""

import json
from pathlib import Path

import pytest

from actuator_glue.api import doctor
from actuator_glue.cli.main import main


def check(text, returncode=0):
    """What a child process would have said."""
    return lambda *_, **__: doctor.subprocess.CompletedProcess((), returncode, text, text)


def examined(monkeypatch, capsys, *options):
    """Exit code, text and JSON of a run whose children answer at once."""
    code = main(['doctor', '--json', '-', *options])
    out, err = capsys.readouterr()
    return code, err, json.loads(out)


@pytest.fixture
def healthy(monkeypatch):
    """A computer whose child processes all answer well."""
    answer = '{"sent": 100, "received": 100, "median": 0.0002, "discovery": 0.1}'
    monkeypatch.setattr(doctor, '_python', check(answer))


def test_a_healthy_computer_is_ready(healthy, monkeypatch, capsys, tmp_path):
    code, text, found = examined(monkeypatch, capsys, '--bags', str(tmp_path))
    assert code == 0 and found['ready'] and 'ready for live tests' in text
    names = [f['name'] for f in found['findings']]
    assert names == ['ros', 'messages', 'dds', 'compiled', 'realtime', 'receive_buffer', 'disk']
    assert not list(tmp_path.iterdir())


def test_a_computer_without_a_home_is_asked_for_a_folder(healthy, monkeypatch, capsys):
    def nobody(self):
        raise RuntimeError('Could not determine home directory.')

    monkeypatch.setattr(Path, 'expanduser', nobody)
    assert main(['doctor']) == 2
    assert 'name another folder with --bags' in capsys.readouterr().err


def test_code_that_is_kept_nowhere_is_told(monkeypatch):
    """What is cold then stays cold: the remedy is a folder for it."""

    def answer(*args, **_):
        if 'warm_windows' in args[-1]:
            raise doctor.subprocess.TimeoutExpired('python', doctor.WARM_SECONDS)
        return check('kept in the memory of this process alone; let NUMBA_CACHE_DIR name')()

    monkeypatch.setattr(doctor, '_python', answer)
    found = doctor.compiled()
    assert found.verdict == 'advice' and 'let NUMBA_CACHE_DIR name' in found.text


def test_what_is_missing_is_named_with_what_to_do(monkeypatch, capsys, tmp_path):
    monkeypatch.setattr(doctor, '_python', check("No module named 'rclpy'", 1))
    code, text, found = examined(monkeypatch, capsys, '--bags', str(tmp_path))
    assert code == 1 and not found['ready']
    missing = {f['name']: f for f in found['findings'] if f['verdict'] == 'missing'}
    assert {'ros', 'messages', 'dds'} <= set(missing)
    assert "No module named 'rclpy'" in missing['ros']['text']
    assert all('setup.bash' in missing[name]['remedy'] for name in ('ros', 'messages'))
    assert 'not ready for live tests: ros, messages, dds' in text
    # A priority that is not granted is no reason not to test.
    assert 'realtime' not in missing


def test_messages_that_do_not_arrive_are_a_fault_and_slow_ones_advice(monkeypatch):
    lost = '{"sent": 100, "received": 99, "median": 0.0002, "discovery": 0.1}'
    monkeypatch.setattr(doctor, '_python', check(lost))
    assert doctor.dds().verdict == 'missing'
    monkeypatch.setattr(
        doctor, '_python', check(lost.replace('99', '100').replace('0.0002', '0.2'))
    )
    assert doctor.dds().verdict == 'advice'


def test_compiling_is_advice(monkeypatch):
    monkeypatch.setattr(doctor, 'WARM_SECONDS', 0.01)
    found = doctor.compiled()
    assert found.verdict == 'advice' and 'cold' in found.text and found.remedy


def test_a_disk_that_cannot_be_written_is_missing():
    assert doctor.disk(Path('/proc/none')).verdict == 'missing'


def test_a_check_that_fails_is_an_answer(healthy, monkeypatch, tmp_path):
    monkeypatch.setattr(doctor, 'RECEIVE_BUFFER', None)
    found = {f.name: f for f in doctor.examine(tmp_path)}
    assert found['receive_buffer'].verdict == 'missing'
    assert 'TypeError' in found['receive_buffer'].text
    assert found['disk'].verdict in ('ok', 'advice')


def test_json_that_cannot_be_written_is_unusable_input(healthy, tmp_path, capsys):
    (tmp_path / 'there').write_text('')
    assert main(['doctor', '--json', str(tmp_path / 'there'), '--bags', str(tmp_path)]) == 2
