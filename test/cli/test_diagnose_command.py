"""`actuator-glue diagnose`: exit codes, JSON, report."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from actuator_glue.cli.main import main
from actuator_glue.errors import InputError
from actuator_glue.model.structure import Structure
from actuator_glue.records import Record
from actuator_glue.report.first_page import command

RATE = 128.0
THETA = np.array([235.0, 5.0e10, 4.23e6, 3.3])
T = np.arange(int(24 * RATE)) / RATE
SWEEP = 2e-3 * np.sin(np.pi * (10.0 / 24.0) * T**2)


def write(path: Path, stiffness: float, play: float, seed: int) -> str:
    """Write a test with play as a laboratory file."""
    silent = Record(SWEEP, SWEEP, 1 / RATE, stiffness=stiffness)
    y = Structure(['backlash']).simulate(np.append(THETA, play), silent)
    y = y + 1e-5 * np.random.default_rng(seed).standard_normal(len(T))
    rows = np.column_stack([T, 1e3 * SWEEP, 1e3 * y])
    np.savetxt(path, rows, delimiter=',', header='time_s,command_mm,measured_mm', comments='')
    return str(path)


def test_a_record_without_stiffness_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Exit code 2 and what to do."""
    assert main(['diagnose', write(tmp_path / 'a.csv', 0.0, 0.0, 1)]) == 2
    assert '--stiffness' in capsys.readouterr().err


@pytest.mark.parametrize(
    'option',
    [['--seed', '-1'], ['--jobs', '0'], ['--prior', 'missing.npz'], ['--drift', '-1']],
)
def test_impossible_options_are_refused(tmp_path: Path, option: list[str]) -> None:
    """Exit code 2."""
    path = write(tmp_path / 'a.csv', 0.0, 0.0, 1)
    assert main(['diagnose', path, '--stiffness', '0', *option]) == 2


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[Record]:
    """What a diagnosis is asked to hold out; it is not made."""
    held: list[Record] = []

    def refuse(records: list[Record], holdout: list[Record], **_: object) -> None:
        held.extend(holdout)
        raise InputError('asked')

    monkeypatch.setattr('actuator_glue.api.diagnosis.diagnose', refuse)
    return held


@pytest.mark.parametrize('turned', [False, True])
def test_a_held_out_record_has_a_stiffness_of_its_own_whatever_the_order(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], asked: list[Record], turned: bool
) -> None:
    """Records of several stiffnesses say nothing of another one; a further value does."""
    free, spring, held = (write(tmp_path / f'{n}.csv', 0.0, 0.0, i) for i, n in enumerate('fsh'))
    files, values = [free, spring], ['0', '250000']
    if turned:
        files, values = files[::-1], values[::-1]
    line = ['diagnose', *files, '--holdout', held, '--stiffness', *values]
    assert main(line) == 2
    told = capsys.readouterr().err
    assert 'h.csv: the specimen stiffness of this held-out record is not known' in told
    assert f'as in --stiffness {" ".join(values)} K' in told
    assert not asked
    assert main([*line, '100e3']) == 2
    assert 'asked' in capsys.readouterr().err
    assert [record.stiffness for record in asked] == [100e3]


def test_the_one_stiffness_of_all_records_is_taken_and_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], asked: list[Record]
) -> None:
    """What a file says itself wins."""
    one, other, held = (write(tmp_path / f'{n}.csv', 0.0, 0.0, i) for i, n in enumerate('abh'))
    says = tmp_path / 'says.csv'
    says.write_text('# stiffness_N_per_m=5e4\n' + Path(held).read_text())
    line = ['diagnose', one, other, '--stiffness', '250e3', '250e3']
    assert main([*line, '--holdout', held, '--holdout', str(says)]) == 2
    told = capsys.readouterr().err
    assert 'h.csv: held out, and its specimen stiffness is not said' in told
    assert 'that of the fitted records is taken, 250000 N/m' in told
    assert 'says.csv' not in told
    assert [record.stiffness for record in asked] == [250e3, 5e4]


def test_the_next_command_says_what_was_said_of_held_out_records() -> None:
    """Typed as it stands it is not refused."""
    fitted, held = [('a', 0.0), ('b', 250e3)], [('c', 100e3)]
    said = command('diagnose', fitted, held=held)
    assert said == 'actuator-glue diagnose a b --stiffness 0 250000 100000 --holdout c'
    said = command('diagnose', [('a', 0.0)], held=[('c', 0.0)])
    assert said == 'actuator-glue diagnose a --stiffness 0 --holdout c'
    said = command('diagnose', [('a', 0.0)], held=[('c', 5.0)])
    assert said == 'actuator-glue diagnose a --stiffness 0 5 --holdout c'


@pytest.mark.slow
def test_play_is_diagnosed_with_json_and_report(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """One stiffness per record, and one for the held-out record."""
    free = write(tmp_path / 'free.csv', 0.0, 6e-5, 1)
    spring = write(tmp_path / 'spring.csv', 250e3, 6e-5, 2)
    held = write(tmp_path / 'held.csv', 250e3, 6e-5, 3)
    out, report = tmp_path / 'd.json', tmp_path / 'd.html'
    files = ['--json', str(out), '--report', str(report)]
    stiffness = ['--stiffness', '0', '250e3', '250e3']
    code = main(['diagnose', free, spring, *stiffness, '--holdout', held, *files])
    assert code == 0
    assert 'missing: backlash' in capsys.readouterr().out
    content = json.loads(out.read_text())
    assert content['schema'] == 'actuator_glue.diagnosis/1'
    assert content['effects'][0]['name'] == 'backlash'
    assert content['seconds'] > 0.0
    page = report.read_text()
    assert page.count('data:image/png') >= 6
    assert 'missing: backlash' in page


@pytest.mark.slow
def test_a_reader_that_has_gone_takes_nothing_from_the_json(tmp_path: Path) -> None:
    """`calibrate ... --json FILE | true`: the file is written before anything is printed."""
    record, out = write(tmp_path / 'a.csv', 0.0, 0.0, 1), tmp_path / 'c.json'
    line = ['calibrate', record, '--stiffness', '0', '--evaluations', '20000', '--json', str(out)]
    code = 'import sys; from actuator_glue.cli.main import main; sys.exit(main(sys.argv[1:]))'
    with subprocess.Popen([sys.executable, '-c', code, *line], stdout=subprocess.PIPE) as running:
        assert running.stdout is not None
        running.stdout.close()
    assert json.loads(out.read_text())['schema'].startswith('actuator_glue.')
