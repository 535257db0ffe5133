"""Say what a bag or laboratory file holds: topics, records, rates, ranges, damage."""

from __future__ import annotations

import argparse
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from actuator_glue.cli._output import add_json, fault, note, say, table
from actuator_glue.cli._records import add_records, first_of, resampling
from actuator_glue.errors import InputError
from actuator_glue.io.json_file import write_json
from actuator_glue.io.units import factor
from actuator_glue.motion import METRES, speaking
from actuator_glue.records import Record

if TYPE_CHECKING:
    from actuator_glue.io.load import Stiffness

EXAMPLES = (
    'info test.csv',
    'info bag_of_test --json -',
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add_records(parser)
    parser.add_argument(
        '--unit',
        choices=('mm', 'm', 'um', 'in'),
        default='mm',
        help='unit of displacements that are shown (default mm); JSON is in m',
    )
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    """Print what each path holds; 2 where one is damaged or holds no record.

    Raises:
        InputError: a path cannot be read at all.
    """
    from actuator_glue.io.bag_reader import is_bag
    from actuator_glue.io.load import load_records

    code, files = 0, []
    # Each path is read by itself, so that one that is damaged hides none of the others.
    for path, stiffness in zip(args.records, _stiffnesses(args), strict=True):
        content: dict[str, Any] = {'path': str(path), 'damage': [], 'warnings': []}
        if is_bag(path):
            content |= _bag(path, args)
        records: list[Record] = []
        try:
            records = load_records(
                path,
                stiffness=stiffness,
                channels=args.channels,
                hold=args.hold,
                resample=resampling(args),
                note=lambda _: None,
                gap=content['warnings' if args.split else 'damage'].append,
                warn=content['warnings'].append,
            )
        except InputError as error:
            content['damage'].append(str(error))
        code = 2 if content['damage'] else code
        for kind, tell in (('damage', fault), ('warnings', note)):
            lines, more = first_of(content[kind], 'of such lines', [path], args)
            for line in (*lines, *more):
                tell(line)
        shown, more = first_of(records, 'records', [path], args)
        for record in shown:
            with speaking(record.motion):
                _show(record, args)
        for line in more:
            say(line, args)
        content['records'] = [_describe(r) for r in records]
        files.append(content)
    write_json({'schema': 'actuator_glue.info/1', 'files': files}, args.json)
    return code


def _stiffnesses(args: argparse.Namespace) -> list[list[Stiffness] | None]:
    """Return what --stiffness says of each path: one value of its own, or all of them."""
    given = args.stiffness
    if given is not None and len(given) == len(args.records):
        return [[k] for k in given]
    return [given] * len(args.records)


def _bag(path: str, args: argparse.Namespace) -> dict[str, Any]:
    from actuator_glue.io.bag_reader import summarise
    from actuator_glue.report import weights

    summary = summarise(path)
    filled = [p for p in summary.parts if p.count]
    start = min((p.start for p in filled), default=0)
    seconds = (max((p.stop for p in filled), default=0) - start) * 1e-9
    # `.mcap.zstd` is how `ros2 bag` compresses whole files.
    size = sum(p.stat().st_size for p in Path(path).glob('*.mcap*')) if Path(path).is_dir() else 0
    size = size or Path(path).stat().st_size
    total = sum(p.count for p in summary.parts)
    say(
        f'{path}: {len(summary.parts)} file(s), {size / 1e6:.2f} MB, {total} messages, '
        f'{seconds:.3f} s, {"finished" if summary.finished else "not finished"}',
        args,
    )
    topics = list(summary.topics.values())
    rows = [(t.name, t.type, str(t.count)) for t in topics]
    table('', ('topic', 'type', 'messages'), rows, args)
    carried = weights.of_bag(path)
    for topic, course in carried.items():
        table(
            f'{weights.TITLE} ({topic})',
            weights.HEADER,
            weights.rows(weights.spells(course)),
            args,
        )
    return {
        'finished': summary.finished,
        'messages': total,
        'start_ns': start,
        'seconds': seconds,
        'topics': [
            {'name': t.name, 'type': t.type, 'messages': t.count, 'type_hash': t.rihs01}
            for t in topics
        ],
        'explanations': {
            topic: [asdict(spell) for spell in weights.spells(course)]
            for topic, course in carried.items()
        },
        'damage': list(summary.damage),
    }


def _show(record: Record, args: argparse.Namespace) -> None:
    k = record.stiffness
    stiffness = 'specimen stiffness not known' if k is None else f'stiffness {k / 1e3:.6g} kN/m'
    if k is not None and record.motion != METRES:
        stiffness = 'no specimen'  # nothing else has a stiffness in N/m
    say(
        f'record {record.source}: {len(record)} samples at {record.rate:.6g} Hz, '
        f'{record.duration:.6g} s; {record.actuator}, {stiffness}, hold {record.hold}',
        args,
    )
    unit = args.unit if record.motion == METRES else 'mm'  # which is said in its own unit
    scale = 1.0 / factor('command', unit, '--unit')
    channels = [(n, getattr(record, n) * scale, unit) for n in ('command', 'measured')]
    if record.force is not None:
        channels.append(('force', record.force * 1e-3, 'kN'))
    for name, values, shown in channels:
        say(f'  {name:9} {values.min():10.5g} .. {values.max():10.5g} {shown}', args)


def _describe(record: Record) -> dict[str, Any]:
    force = record.force
    return {
        'source': record.source,
        'actuator': record.actuator,
        'samples': len(record),
        'rate_hz': record.rate,
        'duration_s': record.duration,
        'start_ns': record.start_ns,
        'first_index': record.first_index,
        'stiffness_n_per_m': record.stiffness,
        'hold': record.hold,
        'motion': record.motion,
        'command_m': [record.command.min(), record.command.max()],
        'measured_m': [record.measured.min(), record.measured.max()],
        'force_n': None if force is None else [force.min(), force.max()],
    }
