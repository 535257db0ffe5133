"""Running commands in this process, as the entry point does."""

import contextlib
import io
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from actuator_glue.cli.main import main


class Done(NamedTuple):
    """What a command left."""

    code: int
    out: str
    err: str

    @property
    def json(self) -> dict[str, Any]:
        """Standard output as JSON, strictly: no NaN."""

        def refuse(name: str) -> None:
            raise AssertionError(f'{name} is no JSON')

        content: dict[str, Any] = json.loads(self.out, parse_constant=refuse)
        return content

    @property
    def message(self) -> str:
        """The one message of a refused command."""
        lines = [line for line in self.err.splitlines() if not line.startswith('note: ')]
        assert len(lines) == 1, self.err
        assert lines[0].startswith('actuator-glue: ')
        assert 'Traceback' not in self.err
        return lines[0]


def run_command(*arguments: object) -> Done:
    """Run a command."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = main([str(a) for a in arguments])
    return Done(code, out.getvalue(), err.getvalue())


@pytest.fixture(scope='session')
def run() -> Callable[..., Done]:
    """Return a function that runs a command."""
    return run_command


@pytest.fixture(scope='session')
def problem_r(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Problem R as two CSV files, r_1.csv (k = 0) and r_2.csv (k = 250 kN/m)."""
    folder = tmp_path_factory.mktemp('problem_r')
    out = folder / 'r.csv'
    assert run_command('simulate', out, '--plant', 'problem-r', '--unit', 'm').code == 0
    return folder


@pytest.fixture(scope='session')
def short_bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Eight seconds at 100 Hz with k = 250 kN/m, as a bag."""
    bag = tmp_path_factory.mktemp('short') / 'bag'
    options = ('--rate', 100, '--duration', 8, '--f1', 5, '--stiffness', 250e3, '--block', 10)
    assert run_command('simulate', bag, *options).code == 0
    return bag
