"""The help of each command ends with two examples that can be typed as they stand."""

import contextlib
import io
import shlex

import pytest

from actuator_glue.cli.main import build_parser, commands, main


@pytest.mark.parametrize('command', sorted(commands()))
def test_help_ends_with_two_examples_that_parse(command: str) -> None:
    """Of this command, different ones, accepted by its own parser."""
    out = io.StringIO()
    with contextlib.redirect_stdout(out):
        assert main([command, '--help']) == 0
    *_, title, first, second = out.getvalue().rstrip().splitlines()
    assert title == 'Examples:'
    assert first != second
    for line in (first, second):
        program, *words = shlex.split(line)
        assert (program, words[0]) == ('actuator-glue', command)
        assert build_parser(command).parse_args(words).run
