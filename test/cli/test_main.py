"""The entry point: light, lazy, and never a traceback."""

import argparse
import os
import subprocess
import sys
from pathlib import Path

import pytest

from actuator_glue.arguments import whole
from actuator_glue.cli import main as entry
from actuator_glue.cli._output import table
from actuator_glue.errors import InputError

EVERY = sorted(entry.commands())
WANTED = {'simulate', 'convert', 'info', 'calibrate', 'replay', 'plot', 'recover'}
HEAVY = ('numba', 'scipy', 'matplotlib', 'arviz', 'rosbags', 'control', 'rich', 'rclpy')


def python(code: str, **options: object) -> subprocess.CompletedProcess[str]:
    """Run a line of Python in a process of its own."""
    return subprocess.run(
        [sys.executable, '-c', code], capture_output=True, text=True, check=False, **options
    )


# Commands that leave no file behind.
WRITES_NOTHING = {'completion', 'view'}


def test_help_names_every_command_with_one_line(run) -> None:
    """Each command is listed with the first line of its docstring."""
    done = run('--help')
    assert done.code == 0
    assert set(entry.commands()) >= WANTED
    for name, file in entry.commands().items():
        assert name in done.out
        assert len(entry.summary(file)) > 20, name


@pytest.mark.parametrize(
    ('text', 'number'), [('6e4', 60_000), ('18446744073709551617', 2**64 + 1), (' 3 ', 3)]
)
def test_whole_numbers_may_have_an_exponent(text: str, number: int) -> None:
    """As in Python; none loses a digit."""
    assert whole(text) == number


@pytest.mark.parametrize('text', ['1.5', 'abc', 'nan', '1e999', '6e-1', ''])
def test_what_is_no_whole_number_is_refused(run, text: str) -> None:
    done = run('calibrate', 'a.csv', '--evaluations', text)
    assert done.code == 2
    assert 'argument --evaluations: ' in done.err
    assert 'invalid' not in done.err


def test_the_title_of_a_narrow_table_stays_on_a_line(capsys: pytest.CaptureFixture[str]) -> None:
    """As it is, whatever it holds; so does one as wide as a terminal."""
    title = 'refitted [x] :smile: ' + 40 * 'long '
    table(title, ['a', 'b'], [['c', '1']], argparse.Namespace(json=None))
    assert capsys.readouterr().out.splitlines()[0] == title


@pytest.mark.parametrize('command', EVERY)
def test_every_command_explains_itself(run, command: str) -> None:
    """`COMMAND --help` works, names the exit codes, and every option has a help text."""
    done = run(command, '--help')
    assert done.code == 0
    assert 'Exit codes: 0 done;' in ' '.join(done.out.split())
    assert ('--force' in done.out) == (command not in WRITES_NOTHING)
    import importlib

    parser = argparse.ArgumentParser()
    importlib.import_module(f'actuator_glue.cli.{command.replace("-", "_")}').add_arguments(parser)
    assert all(action.help for action in parser._actions)


def test_help_is_light_and_quick() -> None:
    """No heavy library is imported, and it costs half a second of a core beside bare Python."""
    done = python(
        'import sys; from actuator_glue.cli.main import build_parser; build_parser(None)\n'
        f'print([m for m in {HEAVY!r} if m in sys.modules])'
    )
    assert done.stdout.strip() == '[]', done.stderr

    def best(code: str) -> float:
        def once() -> float:
            before = os.times()
            python(code)
            after = os.times()
            return after.children_user + after.children_system - sum(before[2:4])

        return min(once() for _ in range(3))

    extra = best('from actuator_glue.cli.main import build_parser; build_parser(None)')
    assert extra - best('pass') <= 0.5


@pytest.mark.parametrize('command', sorted(WANTED))
def test_arguments_are_light(command: str) -> None:
    """Heavy libraries wait until a command has its arguments."""
    done = python(
        'import sys; from actuator_glue.cli.main import build_parser\n'
        f'build_parser({command!r})\n'
        f'print([m for m in {HEAVY!r} if m in sys.modules])'
    )
    assert done.stdout.strip() == '[]', done.stderr


def parse(*arguments: object) -> argparse.Namespace:
    """Return what a command is given."""
    return entry.build_parser(str(arguments[0])).parse_args([str(a) for a in arguments])


@pytest.mark.parametrize('command', ['calibrate', 'diagnose', 'info', 'plot'])
@pytest.mark.parametrize(
    'arguments',
    [
        ('--stiffness', '0', '250e3', 'a.csv', 'b.csv'),
        ('a.csv', 'b.csv', '--stiffness', '0', '250e3'),
        ('a.csv', '--stiffness', '0', '--stiffness', '250e3', 'b.csv'),
        ('a.csv', '--stiffness', '0', '250e3', 'b.csv'),
        ('--stiffness=0', 'a.csv', 'b.csv', '--stiffness=250e3', '--hold', 'zoh'),
    ],
)
def test_records_may_stand_after_stiffnesses(command: str, arguments: tuple[str, ...]) -> None:
    """Numbers after --stiffness are stiffnesses; what is no number is a record."""
    found = parse(command, *arguments)
    assert found.records == ['a.csv', 'b.csv']
    assert found.stiffness == [0.0, 250e3]


@pytest.mark.parametrize(
    'arguments',
    [
        ('--stiffness', '0', '250e3', '--', '-a.csv', 'b.csv'),
        ('--stiffness=0', '--stiffness=250e3', '--', '-a.csv', 'b.csv'),
    ],
)
def test_a_name_may_begin_with_a_dash(arguments: tuple[str, ...]) -> None:
    """Behind `--`, as everywhere; where that lies is the same file."""
    found = parse('info', *arguments)
    assert found.records == ['./-a.csv', 'b.csv']
    assert found.stiffness == [0.0, 250e3]


@pytest.mark.parametrize('command', ['calibrate', 'diagnose', 'info', 'convert'])
def test_unknown_is_a_stiffness_among_others(command: str) -> None:
    """One value per record, and this word is one; where no such value can be, it is a name."""
    out = ['out.csv'] if command == 'convert' else []
    for values in (['0', 'unknown'], ['unknown', '250e3'], ['unknown', 'unknown']):
        found = parse(command, 'a.csv', '--stiffness', *values, 'b.csv', *out)
        assert found.records == ['a.csv', 'b.csv']
        assert found.stiffness == [v if v == 'unknown' else float(v) for v in values]
    assert parse('simulate', '--stiffness', 0, 'unknown').out == 'unknown'


@pytest.mark.parametrize(
    ('command', 'words'),
    [
        ('calibrate', 'one stiffness is given and another is unknown; calibrate the tests'),
        ('diagnose', 'specimen stiffness is not known; give it with --stiffness'),
    ],
)
def test_a_mixture_that_cannot_be_used_is_called_so(
    run, short_bag: Path, tmp_path: Path, command: str, words: str
) -> None:
    """The sentence is about stiffnesses, not about a file called `unknown`."""
    other = tmp_path / 'b.csv'
    assert run('simulate', other, '--rate', 100, '--duration', 8, '--seed', 5).code == 0
    done = run(command, short_bag, other, '--stiffness', 250e3, 'unknown')
    assert done.code == 2
    assert words in done.message
    assert '`unknown`' in run(command, '--help').out


def test_outputs_may_stand_after_stiffnesses() -> None:
    """The last name is the output, wherever options stand."""
    found = parse('convert', 'a.csv', '--stiffness', '-1', 'b.csv', '--unit', 'm', 'out.csv')
    assert (found.records, found.out, found.stiffness) == (['a.csv', 'b.csv'], 'out.csv', [-1.0])
    assert parse('simulate', '--stiffness', 0, 5, 'out').stiffness == [0.0, 5.0]
    assert parse('replay', '--stiffness', 0, 'a.csv').bag == 'a.csv'


@pytest.mark.parametrize(
    ('arguments', 'words'),
    [
        (('calibrate',), 'required: RECORD'),
        (('calibrate', 'a.csv', '--stiffness', 'soft'), "'soft' is not a number"),
        (('calibrate', 'a.csv', '--seed', '\x1b[31m'), r'\x1b[31m'),
        (('calibrate', 'a.csv', '--no-such'), 'unrecognized arguments: --no-such'),
        (('replay',), 'required: BAG'),
        (('calibrat',), "invalid choice: 'calibrat'"),
    ],
)
def test_argument_errors_are_usage_and_error(run, arguments: tuple[str, ...], words: str) -> None:
    """Two short lines, exit 2."""
    done = run(*arguments)
    assert done.code == 2
    assert done.out == ''
    usage, error = done.err.splitlines()
    assert usage.startswith('usage: actuator-glue ')
    assert error.startswith('actuator-glue: ')
    assert words in error
    assert len(usage) < 100


def test_no_command_and_wrong_command_are_2(run) -> None:
    """Help where nothing is asked, one line where the command is unknown."""
    assert run().code == 2
    done = run('calibrat')
    assert done.code == 2
    assert 'calibrat' in done.err
    assert run('--version').code == 0
    assert run('info').code == 2


@pytest.mark.parametrize(
    ('error', 'code', 'words'),
    [
        (InputError('x: wrong'), 2, 'x: wrong'),
        (KeyboardInterrupt(), 130, 'interrupted'),
        (MemoryError(), 2, 'memory'),
        (PermissionError(13, 'Permission denied', '/x'), 2, '/x: Permission denied'),
        (ZeroDivisionError('division by zero'), 3, 'report it'),
    ],
)
def test_errors_become_one_line(
    run, monkeypatch: pytest.MonkeyPatch, error: BaseException, code: int, words: str
) -> None:
    """Whatever a command raises is one line and an exit code; --debug shows where from."""
    from actuator_glue.cli import info

    def fail(args: object) -> int:
        raise error

    monkeypatch.setattr(info, 'run', fail)
    done = run('info', 'x')
    assert done.code == code
    assert words in done.message
    if isinstance(error, ZeroDivisionError):
        with pytest.raises(ZeroDivisionError):
            run('info', 'x', '--debug')


def test_the_end_of_a_command_looks_for_no_garbage() -> None:
    """A process that had calibrated took a second to end."""
    done = python(
        'import atexit, gc; atexit.register(lambda: print(gc.get_freeze_count() > 0)); '
        "from actuator_glue.cli.main import main; main(['--version'])"
    )
    assert done.stdout.splitlines()[-1] == 'True', done.stderr
