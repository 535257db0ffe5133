"""Options that say which records, and loading them."""

from __future__ import annotations

import argparse
import shlex
from collections.abc import Sequence
from typing import TYPE_CHECKING, TypeVar

from actuator_glue.arguments import Input, number, only_with, stiffness
from actuator_glue.cli._as_asked import as_asked
from actuator_glue.cli._output import note
from actuator_glue.io.formats import formats
from actuator_glue.records import Record
from actuator_glue.report.first_lines import few

if TYPE_CHECKING:
    from actuator_glue.io.resample import Resample

T = TypeVar('T')


def add_records(parser: argparse.ArgumentParser) -> None:
    """Add RECORD... and the options of `add_reading`."""
    parser.add_argument(
        'records',
        nargs='+',
        type=Input,
        metavar='RECORD',
        help=f'bag folder, .mcap, {", ".join(formats())}, or other text with --channels',
    )
    add_reading(parser)


def add_reading(parser: argparse.ArgumentParser) -> None:
    """Add --stiffness, --channels, --hold, --resample, --resample-by and --split."""
    parser.add_argument(
        '--stiffness',
        action='append',
        type=stiffness,
        metavar='N/m...',
        help='specimen stiffness: one for all records or one per record (250 kN/m is 250e3, 0 is '
        'a free actuator or a shaking table, `unknown` leaves it open: `calibrate` takes that of '
        'all records or of none, `diagnose` of none); wins over what files say',
    )
    parser.add_argument(
        '--channels',
        type=Input,
        metavar='MAP.yaml',
        help='channel map: columns of files, or topics of a bag',
    )
    parser.add_argument(
        '--hold',
        choices=('zoh', 'linear'),
        help='how the command runs between its samples; wins over what a file says '
        '(a wrong one is a delay of half a sample)',
    )
    parser.add_argument(
        '--resample',
        type=number,
        metavar='HZ',
        help='make the jittered clock of a file even; what is lost, and how far its stamps may be '
        'off, is told beside the record',
    )
    parser.add_argument(
        '--resample-by',
        choices=('band-limited', 'lines'),
        help='how: band-limited keeps more of what is fast, straight lines make no overshoot at '
        'steps (default band-limited)',
    )
    parser.add_argument(
        '--split',
        action='store_true',
        help='where a bag lacks samples or its clock jumps, take the stretches between as '
        'records of their own',
    )


def resampling(args: argparse.Namespace) -> Resample | None:
    """Return what --resample and --resample-by say.

    Raises:
        InputError: a way, and no rate.
    """
    only_with(args, '--resample-by', '--resample')
    return None if args.resample is None else (args.resample, args.resample_by or 'band-limited')


def first_of(
    found: Sequence[T], what: str, paths: Sequence[str], args: argparse.Namespace
) -> tuple[Sequence[T], list[str]]:
    """Return the first of what may be thousands, and a line on the command that has them all.

    Args:
        found: of one kind.
        what: they are, in the plural.
        paths: where they were found.
        args: of this command; what it says of reading the paths, the other one needs, too.
    """
    every = as_asked(f'actuator-glue info {shlex.join(paths)} --split --json OUT', args)
    return few(found, what, f'{len(found)} in all: `{every}` has them')


def load(args: argparse.Namespace) -> list[Record]:
    """Return the records that the options name; where bags are split is told.

    Raises:
        InputError: a record cannot be used.
    """
    from actuator_glue.io.load import load_records
    from actuator_glue.motion import speak

    gaps: list[str] = []
    try:
        found = load_records(
            args.records,
            stiffness=args.stiffness,
            channels=args.channels,
            hold=args.hold,
            resample=resampling(args),
            gap=gaps.append if args.split else None,
            warn=note,
        )
    finally:
        shown, more = first_of(gaps, 'gaps', args.records, args)
        for line in (*shown, *more):
            note(line)
    speak(found[0].motion)
    return found
