"""What a file says of a test beside its columns: comments of a text, attributes, properties."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Mapping

from actuator_glue.errors import InputError
from actuator_glue.io.noted_rate import add_rate, is_rate, plain, rate_of

# What is understood, and what each is written as.
NOTES = {
    'stiffness_N_per_m': 'the specimen stiffness in N/m',
    'hold': 'zoh or linear',
    'actuator': 'its name',
}
_PLAIN = {name.casefold(): name for name in NOTES}
# Names that can only be meant for one of these.
_MEANT = {
    'stiffness_N_per_m': re.compile(
        r'(?:specimen_)?stiffness(?:_?[\[(]?[km]?n(?:_?per_?|_?/_?)[cmµu]?m\W*)?'
    ),
    'hold': re.compile(r'(?:command_)?hold(?:_type|_mode|_order|_of_(?:the_)?command)?'),
}
# Values that state one of these; other words behind a colon are prose.
_STATED = {
    'stiffness_N_per_m': re.compile(
        r'[+-]?(?:\d+(?:[.,]\d*)?|[.,]\d+)(?:e[+-]?\d+)?'
        r'(?:\s*|\s*[\[(]?(?:[kmg]?n|lbf?|kips?|kgf)\s*(?:/|\bper\b)\s*'
        r'(?:[cmµμu]?m|in|inch|ft)\b.*)'
    ),
    'hold': re.compile(
        r'(?:zoh|foh|linear\w*|(?:zero|first)[\s_-]*order|straight|step(?:s|wise)?|held|ramp\w*'
        r'|interpolat\w*)\b.*|zero|first'
    ),
}
# A `Hold: 5 s` is that of a load; 0, 1 and `1st` may be the order of the command's.
_HOLD_OF_A_LOAD = re.compile(
    r'(?!.*(?:order|linear|[zf]oh))(?![01](?:\.0*)?$)(?!\d+(?:st|th)\b)[+-]?\d.*'
)
# What stands in the place of a value and says nothing.
_NOTHING = re.compile(r'none|off|no|n/?a|tbd|unknown|[-?]*')
_TYPED = 0.85  # as alike as words are where a letter of a long one is missing or exchanged


def note_of(name: str) -> str | None:
    """Return the name of `NOTES` that is written here, in capitals or small; None for no such."""
    return _PLAIN.get(plain(name))


def nearly(name: str) -> bool:
    """Return whether a name is one of `NOTES`, or can only be meant for one."""
    return note_of(name) is not None or _meant(name) is not None or is_rate(name)


def of_variable(name: str, value: str, *, words: bool) -> bool:
    """Return whether a variable says one of `NOTES`, right or nearly, or a sample rate.

    Numbers called `hold` or `actuator` are the laboratory's own, and a `stiffness` is that of its
    model.
    """
    if words:
        return _states(name, value)
    return note_of(name) == 'stiffness_N_per_m' or is_rate(name)


def noted(notes: Mapping[str, str], where: str, *, beside_map: bool = False) -> dict[str, str]:
    """Return what a file says besides, by the names of `NOTES`; other notes are left out.

    Args:
        notes: all that the file says, by the names that it uses; those that are not in `NOTES`
            with the colon behind them where the file has one.
        where: file, for messages.
        beside_map: a channel map describes the file: what is nearly right is prose.

    Raises:
        InputError: a name that is nearly one of `NOTES`, or one said twice, differently.
    """
    found: dict[str, str] = {}
    for name, value in (stated(notes) if beside_map else notes).items():
        known, meant = note_of(name), _meant(name.removesuffix(':'))
        if known is not None:
            if _ours(name, value):
                add_note(found, known, value, where)
        elif meant is not None and not beside_map:
            sign = '' if name.endswith(':') else ' ='
            raise InputError(
                f'{where}: the note {f"{name}{sign} {value}"!r} is not understood; write '
                f'`{meant} = VALUE`, which is {NOTES[meant]}, or take it out'
            )
    return found


def stated(notes: Mapping[str, str]) -> dict[str, str]:
    """Return what words of a laboratory's own say of `NOTES`, right or nearly, and of the rate.

    A `hold` of `5 s` is that of a load, and a `stiffness` `of steel` no number.
    """
    return {n: value for n, value in notes.items() if _is_stated(n.removesuffix(':'), value)}


def of_groups(groups: Iterable[Mapping[str, str]]) -> tuple[dict[str, str], tuple[str, ...]]:
    """Return what the groups of a file say alike, and a line for each note that differs.

    Args:
        groups: names and values; what `stated` leaves out is none.
    """
    said: dict[str, set[str]] = {}
    for group in groups:
        for name, value in stated(group).items():
            said.setdefault(note_of(name) or name, set()).add(value)
    told = tuple(
        f'its groups have different {name} ({", ".join(sorted(values))}), and none is taken; say '
        'which in a channel map'
        for name, values in said.items()
        if len(values) > 1
    )
    return {name: min(values) for name, values in said.items() if len(values) == 1}, told


def take_note(comment: str, notes: dict[str, str], where: str) -> bool:
    """Add what a comment states to the notes; return whether it states anything.

    Raises:
        InputError: as `add_note`.
    """
    name, sign, value = comment.partition('=')
    before, colon, behind = comment.partition(':')
    # One nearly right is refused as with `=`; `Stiffness: see drawing` is prose.
    if colon and _states(before, behind):
        name, sign, value = before if note_of(before) else f'{before.strip()}:', colon, behind
    if sign:
        add_note(notes, name.strip(), value.strip(), where)
    return bool(sign)


def add_note(notes: dict[str, str], name: str, value: str, where: str) -> None:
    """Add what a file says under a name; of what is not meant for us the last counts, no rate.

    Raises:
        InputError: one of `NOTES` is said twice, differently.
    """
    before = notes.get(name, value)
    if _ours(name, before):
        if not _ours(name, value):
            return
        if before != value:
            raise InputError(f'{where}: {name} is said twice, {before!r} and {value!r}; keep one')
    if is_rate(name.removesuffix(':')):
        add_rate(notes, name, value)
    else:
        notes[name] = value


def _states(name: str, value: str) -> bool:
    """Return whether a name with its value behind a colon is a note, right or nearly, no prose."""
    return note_of(name) is not None or _is_stated(name, value)


def _is_stated(name: str, value: str) -> bool:
    meant = note_of(name) or _meant(name)
    if meant in _STATED:
        return _STATED[meant].fullmatch(value.strip().casefold()) is not None
    return meant is not None or rate_of(name, value) is not None


def _ours(name: str, value: str) -> bool:
    """Return whether a name with its value says one of `NOTES`; the hold of a load does not."""
    known, said = note_of(name), value.strip().casefold()
    another = known == 'hold' and _HOLD_OF_A_LOAD.fullmatch(said)
    return known is not None and not another and not _NOTHING.fullmatch(said)


def _meant(name: str) -> str | None:
    words = plain(name)
    for known, pattern in _MEANT.items():
        if pattern.fullmatch(words) is not None:
            return known
    near = difflib.get_close_matches(words, ['stiffness_n_per_m'], 1, _TYPED)
    return 'stiffness_N_per_m' if near else None
