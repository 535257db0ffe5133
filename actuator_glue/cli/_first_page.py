"""The first page of an answer on a terminal: what a report says first, in the same order."""

from __future__ import annotations

import argparse
import shlex
from typing import TYPE_CHECKING

from actuator_glue.cli._output import say, table

if TYPE_CHECKING:
    from actuator_glue.report.first_page import FirstPage

# Options of reading, which the next command needs as this one did.
_READING = ('channels', 'hold', 'resample', 'split', 'effects_file')


def add_partition(parser: argparse.ArgumentParser) -> None:
    """Declare `--partition`."""
    parser.add_argument(
        '--partition',
        metavar='FILE|NAME',
        help='a hybrid test, as `rths` takes it: the answer says whether it bears the delay of '
        'the actuator',
    )


def show_first(page: FirstPage, args: argparse.Namespace) -> None:
    """Print the first page of a result."""
    from actuator_glue.report.html import Picture, Table

    page = page._replace(command=_as_read(page.command, args))
    for block in page.blocks():
        if isinstance(block, Table):
            table(block.caption, block.header, [[str(c) for c in r] for r in block.rows], args)
        elif not isinstance(block, Picture):
            say(block.text, args)


def _as_read(command: str, args: argparse.Namespace) -> str:
    """Return a command with the options by which these records were read."""
    for name in _READING:
        value, option = getattr(args, name, None), f'--{name.replace("_", "-")}'
        if value and f'{option} ' not in command:
            several = [str(v) for v in value] if isinstance(value, list) else [f'{value}']
            for text in [''] if value is True else several:
                command += f' {option} {shlex.quote(text) if text else ""}'.rstrip()
    return command
