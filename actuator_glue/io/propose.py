"""Channel maps proposed for a file that nobody has described: which column is what, and why."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from itertools import combinations, permutations

import numpy as np

from actuator_glue.even_times import uneven
from actuator_glue.io.look import ColumnLook, FileLook
from actuator_glue.io.units import ANGLES, OF_NO_LENGTH, ROLES, bare, contradict, written_unit
from actuator_glue.motion import MOTIONS, TORQUES
from actuator_glue.records import FASTEST_RATE, SLOWEST_RATE, Array
from actuator_glue.velocity_command import is_velocity

# Words of the field for each role, in the languages of controllers; whole words or parts.
_WORDS = {
    'time': r'time|zeit|temps|tiempo|timestamp|^t$|\bsec(onds)?\b',
    'command': r'command|cmd|target|refer|\bref\b|desired|\bdes\b|set.?point|\bsp\b|demand|soll|'
    r'input|program|f(ü|ue)hrung|vorgabe|consign[ea]|riferim|goal|wanted|指令|目[标標]|[设設]定',
    'measured': r'meas|actual|feedback|\bfbk?\b|\bist|respon|achieved|lvdt|encoder|output|posi|'
    r'\bpos\b|displ|\bdisp\b|stroke|kolbenweg|\bweg\b|d[ée]plac|desplaz|spostam|位移|[变変]位',
    'force': r'force|load|kraft|\bcell\b|fuerza|effort|torque|moment|belastung|forza|荷重|载荷|'
    r'^f[xyz]?\d?$|\blc\d?\b|^([kM] ?)?N$',
}
# A column with one of these words in its name is no displacement, whatever else it is called.
_NO_LENGTH = re.compile(
    r'err(or)?\b|deviation|\bdiff|abweichung|veloc|\bvel\b|speed|accel|\bacc\b|press|druck|temp|strain|'
    r'valve|ventil|spool|servo ?current|flow',
    re.IGNORECASE,
)
_SAMPLES = 200_000  # of a channel that are compared
_ALIKE = 0.8  # correlation above which one displacement follows another
_FARTHER = 3.0  # times the command; what moves farther is rather a force, or in another unit
_LATEST = 0.25  # s; no actuator follows later
_DAY = 86_400.0  # s
# Days since 1900, and since year 0, in this century.
_DAYS = ((36_500.0, 73_100.0), (730_400.0, 767_100.0))
# Strokes [m]: the longest, and one of which a thousandth is none of a servo-hydraulic test.
_STROKE, _SHORT_STROKE = 2.0, 0.1
_PAIRS = 100  # of columns that are looked at for a command of velocity


@dataclass(frozen=True, slots=True)
class Guess:
    """One channel of a proposed map.

    Attributes:
        column: which column.
        unit: its unit, or the likeliest where the file does not say.
        reasons: why it is taken for this role.
        unsure: what a reader has to check.
        scale: factor from the file's values to `unit`; -1 where the sign is turned.
    """

    column: ColumnLook
    unit: str
    reasons: tuple[str, ...]
    unsure: tuple[str, ...] = ()
    scale: float = 1.0


@dataclass(frozen=True, slots=True)
class ProposedMap:
    """A proposed channel map.

    Attributes:
        channels: guesses by role; `command` and `measured` may be missing.
        counter: the column that counts samples.
        rate: samples per second, where no column holds times.
        other_commands: names of columns that are commands, but of no displacement.
        integrated: a command of velocity or of a valve, and what follows its integral.
        forces: guesses, each of which may be the force; none is chosen where there are several.
    """

    channels: dict[str, Guess]
    counter: ColumnLook | None
    rate: float | None
    other_commands: tuple[str, ...] = ()
    integrated: tuple[ColumnLook, ColumnLook] | None = None
    forces: tuple[Guess, ...] = ()

    @property
    def complete(self) -> bool:
        """Whether command and measured were found, both lengths, and times or a rate."""
        timed = 'time' in self.channels or self.rate is not None
        found = {'command', 'measured'} <= set(self.channels)
        return found and timed and self.integrated is None


def propose(found: FileLook, given: float | None = None) -> ProposedMap:
    """Return which columns are command, measured displacement, force and time.

    Args:
        found: the file.
        given: samples per second, where the reader knows them.
    """
    columns = [c for c in found.columns if c.moves]
    counter = next((c for c in columns if c.times is None and c.counts), None)
    clock = _clock(columns) if all(c.times is None for c in columns) else None
    rest = [c for c in columns if c is not counter and (clock is None or c is not clock.column)]
    rest = [c for c in rest if len(c.values) == _commonest(rest) or c.times is not None]
    if given is not None:
        clock = None
    rate = given or _rate(found, rest, clock)
    # Without a rate a lag is told in samples.
    channels = _displacements(rest, rate or 1.0)
    forces = _forces(channels, rest)
    if len(forces) == 1:
        channels = {**channels, 'force': forces[0]}
        forces = ()
    if clock is not None:
        channels = {'time': clock, **channels}
    others = [c for c in rest if _called(c, 'command') and not _may_be(c, 'command')]
    told = tuple(c.label.strip() for c in others)
    integrated = _integrated(rest, channels, rate or 1.0)
    rate_told = None if clock is not None else rate
    return ProposedMap(channels, counter, rate_told, told, integrated, forces)


def _integrated(
    columns: list[ColumnLook], chosen: dict[str, Guess], rate: float
) -> tuple[ColumnLook, ColumnLook] | None:
    """Return a command of velocity or of a valve and what it moves, where no command is better."""
    given = [chosen[role].column for role in ('command', 'measured') if role in chosen]
    pairs = [(given[0], given[1])] if len(given) == 2 else list(permutations(columns, 2))
    for one, other in pairs[:_PAIRS]:
        may = not any(_called(one, r) for r in ('measured', 'force')) or _called(one, 'command')
        if may and not _called(other, 'command') and not _called(other, 'force'):
            values = (_at(one, rate), _at(other, rate))
            if is_velocity(*values, 1000.0 if rate == 1.0 else rate):
                return one, other
    return None


def _commonest(columns: list[ColumnLook]) -> int:
    lengths = [len(c.values) for c in columns]
    return max(set(lengths), key=lengths.count, default=0)


def _called(column: ColumnLook, role: str) -> bool:
    return re.search(_WORDS[role], _plain(column.label), re.IGNORECASE) is not None


def _plain(label: str) -> str:
    """Return a name with a blank for every underscore, dot, slash and change of case."""
    return re.sub(r'[_./\[\]()-]|(?<=[a-z])(?=[A-Z])', ' ', label).strip()


def _clock(columns: list[ColumnLook]) -> Guess | None:
    """Return the column of times: it is called so and goes up, or goes on evenly, not by one."""
    even = [c for c in columns if c.rate is not None and not c.counts]
    # What is in seconds and goes up all the time is a clock, whatever it is called.
    named = [
        c
        for c in columns
        if _called(c, 'time') or (c.unit in ROLES['time'] and c.steps is not None)
    ]
    best = [c for c in named if c.steps is not None] or even or named
    if not best:
        return None
    column = next((c for c in best if c.rate is not None), best[0])
    reasons = [f'called {column.label.strip()!r}'] if _called(column, 'time') else []
    if not reasons and column.unit in ROLES['time']:
        reasons = [f'in {column.unit}']
    if column.steps is not None:
        even_clock = column.rate is not None and not uneven(column.steps)
        reasons.append('goes on evenly' if even_clock else 'goes on, in uneven steps')
    guess = _guess(column, 'time', tuple(reasons))
    others = [_name(c) for c in named if c.steps is not None and _differ(c, column)]
    doubt = f'role: {", ".join(others)} may be it as well; channels need the same times'
    return _unsure(guess, (doubt,) * bool(others))


def _differ(one: ColumnLook, other: ColumnLook) -> bool:
    """Whether two columns of times overlap and differ: clocks of two channels.

    Milliseconds beside seconds are one clock, and so is a time of day beside one
    that begins at 0.
    """
    a, b = (c.values[[0, -1]] * ROLES['time'].get(c.unit, 1.0) for c in (one, other))
    apart = float(np.abs(a - b).max()) * 2.0 * len(other.values)
    return bool(a[0] < b[1] and b[0] < a[1] and apart > b[1] - b[0])


def _rate(found: FileLook, rest: list[ColumnLook], clock: Guess | None) -> float | None:
    """Return samples per second: by the clock, by stamps, or as the file states."""
    if clock is not None and clock.column.steps is not None:
        step = float(clock.column.steps.mean()) * clock.scale
        return 1.0 / (step * ROLES['time'][clock.unit])
    if found.period is not None:
        return 1.0 / found.period
    rates = [c.rate for c in rest if c.times is not None and c.rate is not None]
    return max(rates, default=None)


def _counts_days(column: ColumnLook) -> bool:
    """Whether a clock counts days since 1900 or year 0: read as seconds it is absurdly fast."""
    if column.steps is None or column.unit not in ('', 'd', 'day', 'days'):
        return False
    first, step = float(column.values[0]), float(column.steps.mean())
    return any(a < first < b for a, b in _DAYS) and step < 1.0 / FASTEST_RATE < step * _DAY


def _guess(column: ColumnLook, role: str, reasons: tuple[str, ...]) -> Guess:
    """Return a guess with the unit that name or file give, or the likeliest of the role."""
    if column.unit in ROLES[role]:
        named = written_unit(column.label)
        doubt = f'unit: the name says {named!r}, and the file gives {column.unit!r}'
        return Guess(column, column.unit, reasons, (doubt,) * contradict(named, column.unit))
    likeliest = _likeliest(column, role)
    if role == 'time' and _counts_days(column):
        days = 'unit: days, as spreadsheets and MATLAB count them'
        return Guess(column, 's', reasons, (days,), scale=_DAY)
    if not column.unit:
        said = 'the file states none, and a scale may be needed'
    else:
        said = f'the file says {column.unit!r}: give {likeliest} per {column.unit} as `scale`'
    return Guess(column, likeliest, reasons, (f'unit: {said}',))


def _likeliest(column: ColumnLook, role: str) -> str:
    """Return the unit that a column without one has most often; metres where its stroke allows.

    Messages of ROS are in SI units (REP 103).
    """
    message = column.times is not None
    if role == 'force':
        return 'N' if message else 'kN'
    if role in ('command', 'measured'):
        least, most = column.range()
        return 'm' if most - least < (_STROKE if message else _SHORT_STROKE) else 'mm'
    if column.steps is None:
        return 's'
    pace = float(column.steps.mean()) * SLOWEST_RATE
    return next((u for u in ('s', 'ms', 'us') if pace * ROLES['time'][u] <= 1.0), 'ns')


def _in_motion(guess: Guess, other: ColumnLook) -> Guess:
    """Return a guess in the unit of its motion, where the other channel moves in that as well."""
    own, motion = guess.column.unit, MOTIONS.get(other.unit, ('', 0.0))[0]
    if motion and not own:
        doubt = f'unit: the file states none; taken as that of {_name(other)}'
        return replace(guess, unit=other.unit, unsure=(doubt,))
    if motion and MOTIONS.get(own, ('', 0.0))[0] == motion:
        reason = f'in {own}, which is kept; mm per {own} as `scale` makes a length of it'
        return replace(guess, unit=own, reasons=(*guess.reasons, reason), unsure=())
    return guess


def _may_be(column: ColumnLook, role: str) -> bool:
    """Return whether nothing that is written about a column speaks against a role.

    What is called a command is never what is measured, and a force never a displacement.
    """
    command = _called(column, 'command')
    if role == 'force':
        return not command and column.unit not in ROLES['command']
    force = _called(column, 'force') and column.unit not in ROLES['command']
    if force or column.unit in OF_NO_LENGTH or _NO_LENGTH.search(_plain(column.label)):
        return False
    return not command if role == 'measured' else command or not _called(column, 'measured')


def _displacements(columns: list[ColumnLook], rate: float) -> dict[str, Guess]:
    """Return command and measured: by name, or as the two alike of which one follows."""
    could = {r: [c for c in columns if _may_be(c, r)] for r in ('command', 'measured')}
    named = {role: [c for c in found if _called(c, role)] for role, found in could.items()}
    able = {role: named[role] or found for role, found in could.items()}
    certain = all(len(found) == 1 for found in named.values())
    best: tuple[tuple[bool, bool, float], float, float, ColumnLook, ColumnLook] | None = None
    for one, other in combinations(columns, 2):
        orders = [
            pair
            for pair in ((one, other), (other, one))
            if any(pair[0] is c for c in able['command'])
            and any(pair[1] is c for c in able['measured'])
        ]
        if not orders:
            continue
        likeness, lag = follows(_at(one, rate), _at(other, rate), rate)
        for first, second in orders:
            late = lag if first is one else -lag
            # A force moves with what is measured; what is measured moves after the command, about
            # as far.
            rank = (late > 0.5 / rate, _as_far(one, other), abs(likeness))
            if (certain or rank[2] > _ALIKE) and (best is None or rank > best[0]):
                best = (rank, likeness, late, first, second)
    if best is None:
        return {
            role: _guess(found[0], role, (f'called {found[0].label.strip()!r}',))
            for role, found in named.items()
            if len(found) == 1
        }
    _, likeness, late, first, second = best
    return _pair(named, (first, second), likeness, late, rate)


def _as_far(one: ColumnLook, other: ColumnLook) -> bool:
    """Whether two columns move about as far as each other, in their units where both have one."""
    strokes = []
    for column in (one, other):
        least, most = column.range()
        strokes.append((most - least) * ROLES['command'].get(column.unit, 1.0))
    return max(strokes) < _FARTHER * min(strokes)


def _pair(
    named: dict[str, list[ColumnLook]],
    pair: tuple[ColumnLook, ColumnLook],
    likeness: float,
    late: float,
    rate: float,
) -> dict[str, Guess]:
    """Return command and measured with why they are taken, and what speaks against it."""
    first, second = pair
    lag = f'{abs(late):.0f} samples' if rate == 1.0 else f'{1e3 * abs(late):.3g} ms'
    told = f'{lag}, correlation {likeness:.4f}'
    chosen = {}
    for role, column, reason in (
        ('command', first, f'{_name(second)} follows it by {told}'),
        ('measured', second, f'follows {_name(first)} by {told}'),
    ):
        called = any(column is c for c in named[role])
        guess = _guess(column, role, (f'called {column.label.strip()!r}' if called else reason,))
        guess = _in_motion(guess, second if column is first else first)
        doubts = []
        if not called:
            doubts.append('role: told by what the channel does, not by its name')
            if abs(late) <= 0.5 / rate:
                doubts.append('which of the two is the command: neither is later')
        others = [_name(c) for c in named[role] if c is not column]
        if others:
            doubts.append(f'role: {", ".join(others)} may be it as well, by name')
        chosen[role] = _unsure(guess, tuple(doubts))
    if not first.unit and not second.unit and {g.unit for g in chosen.values()} == {'m', 'mm'}:
        # One moves a little further than the other.
        chosen = {role: replace(guess, unit='mm') for role, guess in chosen.items()}
    doubts = []
    if abs(likeness) < _ALIKE:
        doubts.append(f'role: it is not like the command (correlation {likeness:.2f})')
    elif late < -0.5 / rate:
        doubts.append(f'role: it leads the command by {lag}: are the two swapped?')
    scale = 1.0
    if likeness < -_ALIKE:
        doubts.append('sign: it moves against the command, so its scale is -1')
        scale = -1.0
    chosen['measured'] = replace(_unsure(chosen['measured'], tuple(doubts)), scale=scale)
    return chosen


def _forces(chosen: dict[str, Guess], columns: list[ColumnLook]) -> tuple[Guess, ...]:
    """Return the one column that is called a force or has a unit of it; or all that may be it."""
    free = [c for c in columns if all(c is not guess.column for guess in chosen.values())]
    free = [c for c in free if _may_be(c, 'force')]
    named = [c for c in free if _called(c, 'force')]
    units = [c for c in free if c.unit in ROLES['force']]
    called = [c for c in named if bare(c.label) == 'force']
    found = next((some for some in (called, named, units) if len(some) == 1), units or named)
    turns = 'measured' in chosen and chosen['measured'].unit in ANGLES
    guesses = []
    for c in found:
        own = _called(c, 'force')
        reason = (f'called {c.label.strip()!r}' if own else f'its unit is {c.unit}',)
        torque = turns and c.unit in TORQUES
        guesses.append(Guess(c, c.unit, reason) if torque else _guess(c, 'force', reason))
    return tuple(guesses)


def _unsure(guess: Guess, what: tuple[str, ...]) -> Guess:
    return replace(guess, unsure=(*guess.unsure, *what))


def _name(column: ColumnLook) -> str:
    return f'column {column.name}' if isinstance(column.name, int) else str(column.name)


def _at(column: ColumnLook, rate: float) -> Array:
    """Return a channel at uniform times; a topic's messages come when they come."""
    if column.times is None:
        return column.values
    grid = np.arange(0.0, float(column.times[-1]), 1.0 / rate)
    values: Array = np.interp(grid, column.times, column.values)
    return values


def follows(one: Array, other: Array, rate: float) -> tuple[float, float]:
    """Return the greatest correlation of two channels, and by how much the second is later [s].

    Args:
        one: shape (n,).
        other: shape (m,).
        rate: samples per second of both.
    """
    length = min(len(one), len(other), _SAMPLES)
    latest = min(int(_LATEST * (1000.0 if rate == 1.0 else rate)), length // 3)
    if length < 8 or latest < 1:
        return 0.0, 0.0
    a, b = (np.nan_to_num(v[:length] - np.nanmean(v[:length])) for v in (one, other))
    size = 1 << (2 * length - 1).bit_length()
    # c[k] = sum a[n] b[n + k]: its peak is where b repeats a, k samples later.
    spectrum = np.conj(np.fft.rfft(a, size)) * np.fft.rfft(b, size)
    correlation = np.fft.irfft(spectrum, size)
    lags = np.concatenate([np.arange(latest + 1), np.arange(-latest, 0)])
    values = correlation[lags]
    peak = int(np.abs(values).argmax())
    norm = float(np.linalg.norm(a) * np.linalg.norm(b))
    return (float(values[peak]) / norm if norm else 0.0), float(lags[peak]) / rate
