"""Options that say where records go, and writing them there."""

from __future__ import annotations

import argparse
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from actuator_glue.api.bar import progress
from actuator_glue.arguments import Output, add_force, claim, make_room, whole
from actuator_glue.cli._output import say
from actuator_glue.errors import InputError
from actuator_glue.io.formats import writable
from actuator_glue.records import Record

_BLOCK = 64  # samples per message, where nothing else is asked for


def add_out(parser: argparse.ArgumentParser) -> None:
    """Add OUT, --block and --unit."""
    parser.add_argument(
        'out',
        type=Output,
        metavar='OUT',
        help=f'{", ".join(writable())}, or a name without a suffix: the folder of a new bag',
    )
    add_force(parser)
    parser.add_argument(
        '--block', type=whole, metavar='N', help='samples per message of a bag (default 64)'
    )
    parser.add_argument(
        '--unit',
        choices=('mm', 'm'),
        help='unit of displacements in files; m loses not one bit (default mm)',
    )


def check_out(args: argparse.Namespace) -> Path:
    """Return where to write, before any long work is done for it.

    Raises:
        InputError: its suffix is none that can be written, or it is a folder but no bag.
    """
    from actuator_glue.io.bag_reader import is_bag

    out = Path(args.out)
    if out.suffix == '.mcap':
        raise InputError(f'{out}: bags are folders; give a name without .mcap')
    # A bag may be called test_2.5.
    if out.suffix not in writable() and not out.suffix[1:].isdigit() and out.suffix:
        raise InputError(
            f'{out}: {out.suffix} cannot be written; use {", ".join(writable())}, or a name '
            'without a suffix for a bag'
        )
    for option, value, written in (
        ('--block', args.block, out.suffix not in writable()),
        ('--unit', args.unit, out.suffix in writable()),
    ):
        if value is not None and not written:
            what = 'a bag, which is in metres' if option == '--unit' else 'a file without messages'
            raise InputError(f'{option} does nothing for {out}, {what}; take it out')
    if args.block is not None and args.block < 1:
        raise InputError(f'--block {args.block}: a message holds at least one sample')
    if out.exists() and out.is_dir() == (out.suffix in writable()):
        raise InputError(
            f'{out} is {"a folder" if out.is_dir() else "a file"}; choose another name'
        )
    if out.is_dir() and not is_bag(out):
        raise InputError(f'{out} is a folder but no bag; choose another name or move it')
    return out


def save(records: list[Record], args: argparse.Namespace) -> None:
    """Write records as the options say and tell it; several become one bag or numbered files.

    Raises:
        InputError: the output exists or cannot be written.
    """
    out = check_out(args)
    make_room(out)
    written = [out]
    if out.suffix in writable():
        written = _files(records, out, args)
    else:
        with _replacing(out):
            _bag(records, out, args.block or _BLOCK)
    samples = sum(len(r) for r in records)
    say(f'{", ".join(map(str, written))}: {len(records)} record(s), {samples} samples', args)


def _files(records: list[Record], out: Path, args: argparse.Namespace) -> list[Path]:
    from actuator_glue.io.export import write

    paths = [out]
    if len(records) > 1:
        paths = [out.with_name(f'{out.stem}_{i + 1}{out.suffix}') for i in range(len(records))]
    for path in paths:
        claim(path, args)
    with progress('writing', sum(len(r) for r in records)) as done:
        before = 0
        for path, record in zip(paths, records, strict=True):
            write(path, record, unit=args.unit or 'mm')
            before += len(record)
            done(before)
    return paths


@contextmanager
def _replacing(bag: Path) -> Iterator[None]:
    """Move an existing bag aside; restore it if the new one cannot be written."""
    if not bag.exists():
        yield
        return
    old = bag.with_name(f'{bag.name}.old')
    if old.exists():
        raise InputError(f'{old} is there already; move it')
    bag.rename(old)
    try:
        yield
    except BaseException:
        old.rename(bag)
        raise
    shutil.rmtree(old, ignore_errors=True)


def _bag(records: list[Record], out: Path, block: int) -> None:
    """Write records into a new bag, each actuator under a namespace of its own.

    Raises:
        InputError: the bag exists or cannot be written.
    """
    from actuator_glue.io.bag_records import write_record
    from actuator_glue.io.bag_writer import BagWriter

    names = list(dict.fromkeys(r.actuator for r in records))
    written = 0

    def count(samples: int) -> None:
        nonlocal written
        written += samples
        done(written)

    writer = BagWriter(out)
    try:
        with progress('writing', sum(len(r) for r in records)) as done, writer:
            for record in records:
                place = names.index(record.actuator) + 1
                namespace = '' if len(names) == 1 else f'/actuator_{place}'
                write_record(writer, record, namespace=namespace, block=block, progress=count)
    except BaseException:
        # Half a conversion looks like a whole test; it can be made again.
        shutil.rmtree(out, ignore_errors=True)
        raise
