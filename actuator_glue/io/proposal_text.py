"""What is told of a proposed channel map: its YAML, why there is none, why it is refused."""

from __future__ import annotations

import json
from collections.abc import Callable

from actuator_glue.errors import InputError
from actuator_glue.io.channel_map import parse_channel_map
from actuator_glue.io.load import load_records
from actuator_glue.io.look import ColumnLook, FileLook
from actuator_glue.io.propose import Guess, ProposedMap
from actuator_glue.io.units import bare
from actuator_glue.io.yaml_file import parse

_JOIN = '`convert COMMAND_FILE RESPONSE_FILE OUT --join time` (or `correlation`) joins both'
_SHOWN = 8  # blocks of samples, or lengths of columns, that are told


def map_text(found: FileLook, proposal: ProposedMap) -> str:
    """Return a proposal as YAML, with a comment that says why beside each channel.

    Args:
        found: the file.
        proposal: its channels.
    """
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


def why_none(found: FileLook, proposal: ProposedMap) -> str:
    """Return why a file can have no channel map, and what to do.

    Args:
        found: the file.
        proposal: its channels, which are not complete.
    """
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


def leaves_force(found: FileLook, proposal: ProposedMap) -> bool:
    """Whether a column may be the force, and none is called so, as it is where it is read.

    Args:
        found: the file.
        proposal: its channels.
    """
    guessed = proposal.forces or 'force' in proposal.channels
    return bool(guessed) and all(bare(column.label) != 'force' for column in found.columns)


def refusal(path: str, text: str | None, tell: Callable[[str], None]) -> str:
    """Return why a file cannot be read with a map, or without; empty where it can.

    Args:
        path: the file.
        text: the map as YAML; None or empty for none.
        tell: takes what reading warns of.
    """
    try:
        channels = text and parse_channel_map(parse(text, 'proposed map'), 'proposed map')
        load_records(path, channels=channels or None, gap=tell, warn=tell)
    except InputError as error:
        return f'with this map the file is refused: {error}'
    return ''
