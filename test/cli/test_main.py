"""The entry point: light, lazy, and never a traceback."""

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from actuator_glue.cli import main as entry
from actuator_glue.errors import InputError

WANTED = {'simulate', 'convert', 'info', 'calibrate', 'replay', 'plot', 'recover'}
HEAVY = ('numba', 'scipy', 'matplotlib', 'arviz', 'rosbags', 'control', 'rich', 'rclpy')


def python(code: str, **options: object) -> subprocess.CompletedProcess[str]:
    """Run a line of Python in a process of its own."""
    return subprocess.run(
        [sys.executable, '-c', code], capture_output=True, text=True, check=False, **options
    )


def test_help_names_every_command_with_one_line(run) -> None:
    """Each command is listed with the first line of its docstring."""
    done = run('--help')
    assert done.code == 0
    assert set(entry.commands()) >= WANTED
    for name, file in entry.commands().items():
        assert name in done.out
        assert len(entry.summary(file)) > 20, name


@pytest.mark.parametrize('command', sorted(WANTED))
def test_every_command_explains_itself(run, command: str) -> None:
    """`COMMAND --help` works and every option has a help text."""
    done = run(command, '--help')
    assert done.code == 0
    import argparse
    import importlib

    parser = argparse.ArgumentParser()
    importlib.import_module(f'actuator_glue.cli.{command}').add_arguments(parser)
    assert all(action.help for action in parser._actions)


def test_help_is_light_and_quick() -> None:
    """No heavy library is imported, and it takes half a second at most beside bare Python."""
    done = python(
        'import sys; from actuator_glue.cli.main import build_parser; build_parser(None)\n'
        f'print([m for m in {HEAVY!r} if m in sys.modules])'
    )
    assert done.stdout.strip() == '[]', done.stderr

    def best(code: str) -> float:
        def once() -> float:
            start = time.perf_counter()
            python(code)
            return time.perf_counter() - start

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


def test_a_closed_pipe_is_no_error(short_bag: Path) -> None:
    """`actuator-glue info BAG | head -1` ends quietly."""
    read, write = os.pipe()
    os.close(read)
    done = subprocess.run(
        [sys.executable, '-u', '-m', 'actuator_glue.cli.main', 'info', str(short_bag)],
        stdout=write,
        stderr=subprocess.PIPE,
        text=True,
        check=False,
    )
    os.close(write)
    assert done.stderr == ''
    assert done.returncode == 0
