"""Look at an unknown file or bag: its columns with ranges and rates, and a channel map for it."""

from __future__ import annotations

import argparse
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from actuator_glue.arguments import Input, Output, number
from actuator_glue.cli._output import add_json, note, say, table
from actuator_glue.errors import InputError
from actuator_glue.io.json_file import write_json
from actuator_glue.whole_file import whole_file

if TYPE_CHECKING:
    from actuator_glue.io.look import ColumnLook, FileLook
    from actuator_glue.io.propose import Guess

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
    from actuator_glue.io.proposal_text import leaves_force, map_text, refusal, why_none
    from actuator_glue.io.propose import propose

    found = look(args.file)
    if args.rate is not None and not args.rate > 0.0:
        raise InputError(f'--rate {args.rate:g}: give samples per second, more than 0')
    proposal = propose(found, args.rate)
    tell = cache(note)  # what is told of both readings is told once
    plain = not refusal(args.file, None, tell)
    rows = [_row(column, found) for column in found.columns]
    title = f'{args.file}: {found.what}, {len(found.columns)} columns of numbers'
    table(title, ('column', 'unit', 'samples', 'least', 'greatest', 'remark'), rows, args)
    # A bag that we recorded says what its channels are; no other topic of it is a channel.
    ours = plain and found.what == 'bag'
    text = map_text(found, proposal) if proposal.complete and not ours else ''
    refused = refusal(args.file, text, tell) if text else '' if ours else why_none(found, proposal)
    if text:
        for line in text.splitlines():
            say(line, args)
    if text and args.out is not None:
        with whole_file(Path(args.out)) as part:
            part.write_text(text, encoding='utf-8')
        say(f'{args.out}: written; check it, then `info {args.file} --channels {args.out}`', args)
    if plain:
        lost = ', without a force' if leaves_force(found, proposal) and not ours else ''
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
