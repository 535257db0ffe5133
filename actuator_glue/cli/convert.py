"""Convert between laboratory files and bags: CSV, .mat or mapped text to a bag, and back."""

from __future__ import annotations

import argparse
from pathlib import Path

from actuator_glue.cli._output import progress, say
from actuator_glue.cli._records import add_records, load
from actuator_glue.errors import InputError
from actuator_glue.records import Record


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add_records(parser)
    parser.add_argument(
        'out', metavar='OUT', help='.csv, .mat, or the folder of a new bag for any other name'
    )
    parser.add_argument(
        '--block', type=int, default=64, metavar='N', help='samples per message (default 64)'
    )
    parser.add_argument(
        '--unit',
        choices=('mm', 'm'),
        default='mm',
        help='unit of displacements in .csv and .mat; m loses not one bit (default mm)',
    )


def run(args: argparse.Namespace) -> int:
    """Convert; several records become one bag, or one numbered file each.

    Raises:
        InputError: a record cannot be used, or the output exists or cannot be written.
    """
    records = load(args)
    out = Path(args.out)
    if out.suffix == '.mcap':
        raise InputError(f'{out}: bags are folders; give a name without .mcap')
    if out.suffix in ('.csv', '.mat'):
        written = _files(records, out, args.unit)
    else:
        write_bag(records, out, args.block)
        written = [out]
    samples = sum(len(r) for r in records)
    say(f'{", ".join(map(str, written))}: {len(records)} record(s), {samples} samples', args)
    return 0


def _files(records: list[Record], out: Path, unit: str) -> list[Path]:
    from actuator_glue.io.export import write_csv, write_mat

    paths = [out]
    if len(records) > 1:
        paths = [out.with_name(f'{out.stem}_{i + 1}{out.suffix}') for i in range(len(records))]
    for path in paths:
        if path.exists():
            raise InputError(f'{path} exists already; choose another name or move it')
    with progress('writing', sum(len(r) for r in records)) as done:
        before = 0
        for path, record in zip(paths, records, strict=True):
            (write_csv if out.suffix == '.csv' else write_mat)(path, record, unit=unit)
            before += len(record)
            done(before)
    return paths


def write_bag(records: list[Record], out: Path, block: int) -> None:
    """Write records into a new bag, each actuator under a namespace of its own.

    Raises:
        InputError: the bag exists or cannot be written.
    """
    from actuator_glue.io.bag_records import write_record
    from actuator_glue.io.bag_writer import BagWriter

    if block < 1:
        raise InputError(f'--block {block}: a message holds at least one sample')
    names = list(dict.fromkeys(r.actuator for r in records))
    with progress('writing', sum(len(r) for r in records)) as done, BagWriter(out) as writer:
        written = 0

        def count(samples: int) -> None:
            nonlocal written
            written += samples
            done(written)

        for record in records:
            namespace = '' if len(names) == 1 else f'/actuator_{names.index(record.actuator) + 1}'
            write_record(writer, record, namespace=namespace, block=block, progress=count)
