"""The first page of an answer on a terminal: what a report says first, in the same order."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from actuator_glue.arguments import Input
from actuator_glue.cli._as_asked import as_asked
from actuator_glue.cli._output import say, show

if TYPE_CHECKING:
    from actuator_glue.report.first_page import FirstPage


def add_partition(parser: argparse.ArgumentParser) -> None:
    """Declare `--partition`."""
    parser.add_argument(
        '--partition',
        type=Input,
        metavar='FILE|NAME',
        help='a hybrid test, as `rths` takes it: the answer says whether it bears the delay of '
        'the actuator',
    )


def show_first(page: FirstPage, args: argparse.Namespace) -> str:
    """Print the first page of a result; return the command that it ends with, for its report."""
    following = as_asked(page.command, args)
    show(page._replace(command='').blocks(), args)
    say(f'Next: {following}', args)
    return following
