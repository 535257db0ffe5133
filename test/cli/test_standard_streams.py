"""Exit codes and files do not depend on who reads what a command prints."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from actuator_glue.cli import info
from actuator_glue.cli._standard_streams import StandardStream
from actuator_glue.cli.main import main

COMMAND = [sys.executable, '-m', 'actuator_glue.cli.main']
DONE_AND_NO = pytest.mark.parametrize('own', [0, 1])


def shell(line: str, *arguments: object) -> subprocess.CompletedProcess[str]:
    """Run a line of bash in which "$@" is a command of the program."""
    return subprocess.run(
        ['bash', '-c', line, 'bash', *COMMAND, *map(str, arguments)],
        capture_output=True,
        text=True,
        check=False,
    )


def test_a_closed_pipe_is_no_error(short_bag: Path) -> None:
    """`actuator-glue info BAG | true` ends quietly."""
    done = shell('"$@" | true; exit ${PIPESTATUS[0]}', 'info', short_bag)
    assert (done.returncode, done.stderr) == (0, '')


def test_a_closed_pipe_turns_no_refusal_into_a_yes(tmp_path: Path) -> None:
    """Neither where nobody reads what was refused."""
    line = '{ sleep 0.2; "$@"; } 2>&1 | true; exit ${PIPESTATUS[0]}'
    assert shell(line, 'info', tmp_path / 'nope.csv').returncode == 2


@DONE_AND_NO
@pytest.mark.parametrize('buffered', [True, False])
def test_a_reader_that_has_gone_changes_neither_code_nor_files(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, own: int, buffered: bool
) -> None:
    """What a command does after it has printed is done, and its own exit code is returned."""

    def answer(_: object) -> int:
        print('NO-GO\n' * 10_000, flush=not buffered)
        (tmp_path / 'report.html').write_text('drawn after the answer')
        print('and a last word')
        return own

    monkeypatch.setattr(info, 'run', answer)
    read, write = os.pipe()
    os.close(read)
    with os.fdopen(write, 'w') as unread, monkeypatch.context() as patch:
        patch.setattr(sys, 'stdout', unread)
        assert main(['info', 'x.csv']) == own
        assert sys.stdout is unread
    assert (tmp_path / 'report.html').exists()


@DONE_AND_NO
def test_a_full_standard_output_is_told_by_its_name(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], own: int
) -> None:
    """One line and 2, once everything else is done."""
    done: list[str] = []

    def answer(_: object) -> int:
        print('{}', flush=True)
        done.append('report')
        return own

    monkeypatch.setattr(info, 'run', answer)
    with Path('/dev/full').open('w') as full, monkeypatch.context() as patch:
        patch.setattr(sys, 'stdout', full)
        assert main(['info', 'x.csv']) == 2
    assert done == ['report']
    assert capsys.readouterr().err == ('actuator-glue: standard output: No space left on device\n')


def test_json_to_a_closed_standard_output_is_refused_first(short_bag: Path) -> None:
    """With one sentence; without JSON nobody asked for anything to be read."""
    done = shell('"$@" >&-', 'info', short_bag, '--json', '-')
    assert done.returncode == 2
    assert done.stderr.startswith('actuator-glue: --json -: standard output is closed; give')
    assert len(done.stderr.splitlines()) == 1
    assert shell('"$@" >&-', 'info', short_bag).returncode == 0


def test_a_closed_standard_error_puts_no_remark_into_json(short_bag: Path) -> None:
    """What people would read does not take the place of what programs read."""
    done = shell('"$@" 2>&-', 'info', short_bag, '--json', '-')
    assert done.returncode == 0
    assert json.loads(done.stdout)['schema'] == 'actuator_glue.info/1'


@pytest.mark.parametrize('command', [(), ('calibrate',)])
def test_help_that_cannot_be_written_is_told(command: tuple[str, ...]) -> None:
    """As any other output."""
    done = shell('"$@" >/dev/full', *command, '--help')
    assert (done.returncode, done.stderr) == (
        2,
        'actuator-glue: standard output: No space left on device\n',
    )
    assert shell('"$@" | true; exit ${PIPESTATUS[0]}', *command, '--help').returncode == 0


def test_letters_that_a_stream_does_not_have_are_escaped(tmp_path: Path, short_bag: Path) -> None:
    """In answers and in messages: they end no command."""
    record = tmp_path / 'mä.csv'
    assert main(['convert', str(short_bag), str(record)]) == 0
    line = 'PYTHONIOENCODING=ascii:strict "$@"'
    done = shell(line, 'info', record)
    assert (done.returncode, done.stderr) == (0, '')
    assert 'm\\xe4.csv' in done.stdout
    done = shell(line, 'info', tmp_path / 'nö.csv')
    assert done.returncode == 2
    assert 'n\\xf6.csv' in done.stderr


@pytest.mark.parametrize('closed', ['<&- >&-', '<&- 2>&-', '<&- >&- 2>&-'])
def test_no_file_takes_the_number_of_a_closed_stream(tmp_path: Path, closed: str) -> None:
    """Also where standard input is closed, whose number is lower: libraries print to 1 and 2."""
    code = (
        'import os, sys\n'
        'from actuator_glue.cli._standard_streams import standard_streams\n'
        'with standard_streams():\n'
        '    files = [open(f"{sys.argv[1]}/{i}", "w") for i in range(3)]\n'
        '    for number in (1, 2):\n'
        '        os.write(number, b"of a library")\n'
    )
    line = f'"$0" -c "$1" "$2" {closed}'
    subprocess.run(['bash', '-c', line, sys.executable, code, tmp_path], check=True)
    assert [path.read_text() for path in sorted(tmp_path.iterdir())] == ['', '', '']


def test_who_keeps_a_stream_may_write_on() -> None:
    """As a handler of a log does, or a thread: what it writes is dropped."""
    stream = StandardStream(None, 1)
    stream.write('before')
    stream.end()
    stream.write('after')
    stream.flush()
    assert stream.fault == ''
