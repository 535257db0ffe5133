"""Convert between laboratory files and bags, and join two files of one test."""

from __future__ import annotations

import argparse
from dataclasses import replace

from actuator_glue.cli._output import note
from actuator_glue.cli._records import add_records, load, resampling
from actuator_glue.cli._save import add_out, save
from actuator_glue.errors import InputError
from actuator_glue.records import Record

EXAMPLES = (
    'convert test.csv bag_of_test --stiffness 250e3',
    'convert command.csv response.csv joined.csv --join time',
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add_records(parser)
    add_out(parser)
    parser.add_argument(
        '--join',
        choices=('time', 'correlation'),
        help='the two RECORDs are one test, the command in the first and the response in the '
        'second: joined by the clock that both have, or laid beside each other by what is alike',
    )


def run(args: argparse.Namespace) -> int:
    """Convert; several records become one bag, or one numbered file each.

    Raises:
        InputError: a record cannot be used, or the output exists or cannot be written.
    """
    save(load(args) if args.join is None else [_joined(args)], args)
    return 0


def _joined(args: argparse.Namespace) -> Record:
    from actuator_glue.io.join import join

    if len(args.records) != 2:
        raise InputError(
            f'--join takes two files, that of the command and that of the response, not '
            f'{len(args.records)}'
        )
    if args.stiffness is not None and len(args.stiffness) != 1:
        raise InputError('--join makes one record: give one --stiffness')
    known, left_open = None, args.stiffness == ['unknown']
    if args.stiffness is not None and not left_open:
        (known,) = args.stiffness
    found = join(
        *args.records,
        by=args.join,
        channels=args.channels,
        stiffness=known,
        hold=args.hold,
        resample=resampling(args),
        warn=note,
    )
    return replace(found, stiffness=None) if left_open else found
