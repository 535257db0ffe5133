"""Look at an unknown file or bag: its columns with ranges and rates, and a channel map for it."""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from actuator_glue.arguments import Input, Output, make_room, number
from actuator_glue.cli._output import add_json, note, say, table
from actuator_glue.errors import InputError
from actuator_glue.io.json_file import write_json

if TYPE_CHECKING:
    from actuator_glue.io.look import ColumnLook, FileLook
    from actuator_glue.io.propose import Guess, ProposedMap

_JOIN = '`convert COMMAND_FILE RESPONSE_FILE OUT --join time` (or `correlation`) joins both'
_SHOWN = 8  # blocks of samples of a file that are told

EXAMPLES = (
    'map raw.txt --rate 1000 --out map.yaml',
    'map recorded_bag',
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument('file', type=Input, metavar='FILE', help='any file of numbers, or any bag')
    parser.add_argument(
        '--rate', type=number, metavar='HZ', help='samples per second, where no column tells them'
    )
    parser.add_argument(
        '--out', type=Output, metavar='MAP.yaml', help='write the proposed channel map there'
    )
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    """Print columns and proposal; 1 where the file is refused with the map, or can have none.

    Raises:
        InputError: the file cannot be read, or holds no numbers.
    """
    from actuator_glue.io.look import look
    from actuator_glue.io.propose import propose

    found = look(args.file)
    if args.rate is not None and not args.rate > 0.0:
        raise InputError(f'--rate {args.rate:g}: give samples per second, more than 0')
    proposal = propose(found, args.rate)
    tell = cache(note)  # what is told of both readings is told once
    plain = not _fault(args.file, None, tell)
    rows = [_row(column, found) for column in found.columns]
    title = f'{args.file}: {found.what}, {len(found.columns)} columns of numbers'
    table(title, ('column', 'unit', 'samples', 'least', 'greatest', 'remark'), rows, args)
    # A bag that we recorded says what its channels are; no other topic of it is a channel.
    ours = plain and found.what == 'bag'
    text = map_text(found, proposal) if proposal.complete and not ours else ''
    refused = _fault(args.file, text, tell) if text else '' if ours else _missing(found, proposal)
    if text:
        for line in text.splitlines():
            say(line, args)
    if text and args.out is not None:
        _write(Path(args.out), text)
        say(f'{args.out}: written; check it, then `info {args.file} --channels {args.out}`', args)
    if plain:
        lost = ', without a force' if _leaves_force(found, proposal) and not ours else ''
        say(f'{args.file} needs no channel map: it is read as it is{lost}', args)
    if refused and (text or not plain):
        note(refused)
    content = {
        'schema': 'actuator_glue.map/1',
        'path': str(args.file),
        'columns': [_describe(column) for column in found.columns],
        'channels': {role: _reasons(guess) for role, guess in proposal.channels.items()},
        'forces': [_reasons(guess) for guess in proposal.forces],
        'map': text or None,
        'needed': not plain,
        'works': not refused,
        'problem': refused or None,
    }
    write_json(content, args.json)
    return 1 if refused and (text or not plain) else 0


def map_text(found: FileLook, proposal: ProposedMap) -> str:
    """Return a proposal as YAML, with a comment that says why beside each channel."""
    lines = [f'# Proposed for {found.path.name}; check what is marked CHECK.']
    lines += [f'{name}: {json.dumps(value)}' for name, value in found.layout.items()]
    if len(found.blocks) > 1:
        begun = ', '.join(f'{b.rows} below line {b.lines}' for b in found.blocks[:_SHOWN])
        more = len(found.blocks) - _SHOWN
        begun += f' and {more} more' if more > 0 else ''
        lines.append(
            f'#   CHECK block: the longest of {len(found.blocks)} is taken; rows: {begun}'
        )
    if proposal.rate is not None:
        lines.append(f'rate: {proposal.rate:.9g}  # Hz')
    if proposal.counter is not None:
        lines.append(f'sample_number: {_quoted(proposal.counter.name)}  # goes up by one')
    for role, guess in proposal.channels.items():
        lines.append(_entry(role, guess))
        lines += [f'#   CHECK {what}' for what in guess.unsure]
    if proposal.forces:
        lines.append('#   CHECK force: none of these is taken; uncomment the one that is meant')
        lines += [f'# {_entry("force", guess)}' for guess in proposal.forces]
    return '\n'.join(lines) + '\n'


def _entry(role: str, guess: Guess) -> str:
    scale = f', scale: {guess.scale:g}' if guess.scale != 1.0 else ''
    entry = f'{{column: {_quoted(guess.column.name)}, unit: {_quoted(guess.unit)}{scale}}}'
    return f'{role}: {entry}  # {"; ".join(guess.reasons)}'


def _quoted(value: str | int) -> str:
    return json.dumps(value, ensure_ascii=False)


def _fault(path: str, text: str | None, tell: Callable[[str], None]) -> str:
    """Return why the file cannot be read with a map, or without; empty where it can."""
    from actuator_glue.io.channel_map import parse_channel_map
    from actuator_glue.io.load import load_records
    from actuator_glue.io.yaml_file import parse

    try:
        channels = text and parse_channel_map(parse(text, 'proposed map'), 'proposed map')
        load_records(path, channels=channels or None, gap=tell, warn=tell)
    except InputError as error:
        return f'with this map the file is refused: {error}'
    return ''


def _leaves_force(found: FileLook, proposal: ProposedMap) -> bool:
    """Whether a column may be the force, and none is called so, as it is where it is read."""
    from actuator_glue.io.units import bare

    guessed = proposal.forces or 'force' in proposal.channels
    return bool(guessed) and all(bare(column.label) != 'force' for column in found.columns)


def _missing(found: FileLook, proposal: ProposedMap) -> str:
    if proposal.integrated is not None:
        one, other = (_called(column) for column in proposal.integrated)
        return (
            f'{other} follows the integral of {one}, which is the command of a velocity or of a '
            'valve: no displacement command in this file. A displacement command is needed: '
            'record the set point of the position loop'
        )
    names = [role for role in ('command', 'measured') if role not in proposal.channels]
    if not names:
        return 'no column tells the times of the samples; give their rate with --rate HZ'
    lengths = sorted({len(c.values) for c in found.columns if c.times is None}, reverse=True)
    if len(lengths) > 1:
        return (
            f'no {" and no ".join(names)} could be told from these columns, which have '
            f'{" and ".join(map(str, lengths[:_SHOWN]))} samples: channels of one test need one '
            'rate and length'
        )
    if 'command' in names:
        others = ' and '.join(repr(name) for name in proposal.other_commands)
        instead = f'; {others} commands something else' if others else ''
        return (
            'no command in this file: no displacement is called so (command, target, set point, '
            f'demand, reference, soll), and none is followed by another{instead}. A displacement '
            f'command is needed: record it; where another file of the test has it, {_JOIN}; or '
            'name its column in a channel map written by hand (docs/howto_your_data.md)'
        )
    if 'command' in proposal.channels:
        return (
            'no measured displacement could be told from these columns; where another file of the '
            f'test has it, {_JOIN}; else write the channel map by hand (docs/howto_your_data.md)'
        )
    return (
        f'no {" and no ".join(names)} could be told from these columns; write the channel map by '
        'hand (docs/howto_your_data.md)'
    )


def _called(column: ColumnLook) -> str:
    return column.label.strip() or f'column {column.name}'


def _write(path: Path, text: str) -> None:
    make_room(path)
    try:
        path.write_text(text, encoding='utf-8')
    except OSError as error:
        raise InputError(f'{path}: cannot be written ({error.strerror or error})') from error


def _row(column: ColumnLook, found: FileLook) -> tuple[str, ...]:
    low, high = column.range()
    name = str(column.name)
    if column.times is None and not name.endswith(column.label):
        name = f'{name} {column.label}'
    number = [f'{low:.6g}', f'{high:.6g}']
    return (name.strip(), column.unit, str(len(column.values)), *number, _remark(column))


def _remark(column: ColumnLook) -> str:
    if column.times is not None:
        return f'{column.rate:.6g} messages/s' if column.rate else ''
    from actuator_glue.even_times import uneven

    if column.counts:
        return 'goes up by one'
    if column.missing:
        return f'no number in {column.missing} rows'
    steps = column.steps
    if steps is None:
        return '' if column.moves else 'does not move'
    if column.rate is None or uneven(steps):
        return f'uneven steps of {steps.min():.3g} to {steps.max():.3g}'
    return f'even steps of {1.0 / column.rate:.6g}'


def _describe(column: ColumnLook) -> dict[str, Any]:
    low, high = column.range()
    return {
        'column': column.name,
        'label': column.label,
        'unit': column.unit or None,
        'samples': len(column.values),
        'least': low,
        'greatest': high,
        'rate_hz': column.rate if column.times is not None else None,
        'remark': _remark(column) or None,
    }


def _reasons(guess: Guess) -> dict[str, Any]:
    return {
        'column': guess.column.name,
        'unit': guess.unit,
        'scale': guess.scale,
        'reasons': list(guess.reasons),
        'check': list(guess.unsure),
    }
