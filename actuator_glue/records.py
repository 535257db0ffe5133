"""Records: uniformly sampled command and measured displacement of one test."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal, TypeAlias, TypeGuard, TypeVar, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from actuator_glue.errors import InputError
from actuator_glue.even_times import uniform_period
from actuator_glue.given import number, whole
from actuator_glue.motion import METRES, MOTIONS, TORQUES, WRITTEN, spoken
from actuator_glue.si import FORCE, LENGTH

T = TypeVar('T')

Array: TypeAlias = NDArray[np.float64]
Hold: TypeAlias = Literal['zoh', 'linear']

# No servo-hydraulic actuator of a structural laboratory has more stroke than this.
MAX_DISPLACEMENT = 10.0  # m
MAX_FORCE = 1e9  # N
MAX_STIFFNESS = 1e12  # N/m
STIFF = 1e6  # N/m: a stiffer specimen lets an actuator of Table 3 follow the less
# What no servo-hydraulic test violates. The longest strokes, of shake tables, are 2 m; an actuator
# that moves with up to 100 Hz is sampled with 5 Hz at least, and controllers with 100 kHz at most.
LONGEST_STROKE = 2.0  # m
SLOWEST_RATE = 5.0  # Hz
FASTEST_RATE = 100e3  # Hz
# Periods closer than this are one [1]: the last digits of a clock, or of a rate turned over.
_ONE_PERIOD = 1e-4
# Those at the end of a path, and which of its records a source is.
_LAST_SLASHES = re.compile(r'/+( \(record \d+ of \d+\))?$')


def same_period(one: float, other: float) -> bool:
    """Whether two sample periods [s], or two rates [Hz], are one; NaN is none.

    Everything that compares periods asks here, so that what one part of the library takes for a
    single stream no other part takes for many.
    """
    return abs(one - other) <= _ONE_PERIOD * min(abs(one), abs(other))


def _kept(values: ArrayLike) -> TypeGuard[Array]:
    """Whether nobody writes to these values any more: a column of another record."""
    return (
        type(values) is np.ndarray
        and values.dtype == np.float64
        and values.flags.owndata
        and not values.flags.writeable
    )


def numbers(values: ArrayLike) -> Array:
    """Return numbers as a new array of doubles, NaN where they are masked: nobody measured those.

    Raises:
        TypeError, ValueError: what is no number, truth values and complex numbers among them.
    """
    # A list has no type, and numpy drops the imaginary part of what stands in one. Columns of
    # pandas and others have one that may not be numpy's.
    held = values if hasattr(values, 'dtype') else np.asarray(values)
    dtype = held.dtype
    if getattr(dtype, 'kind', '') in ('b', 'c', 'm', 'M'):
        raise TypeError(f'{dtype} is no displacement or force')
    if getattr(dtype, 'kind', '') == 'O':
        turned = (
            v for v in np.ravel(np.asarray(held)) if isinstance(v, (complex, np.complexfloating))
        )
        if (first := next(turned, None)) is not None:
            raise TypeError(f'{first} is no displacement or force')
    if isinstance(values, np.ma.MaskedArray):
        return np.asarray(np.ma.filled(values.astype(np.float64), np.nan))
    return np.array(held, dtype=np.float64)


def _vector(values: ArrayLike) -> ArrayLike:
    """Return a column or a row, (n, 1) or (1, n) as MATLAB's files hold them, as (n,)."""
    shape = getattr(values, 'shape', ())
    if len(shape) != 2 or 1 not in shape:
        return values
    return values.ravel() if isinstance(values, np.ma.MaskedArray) else np.asarray(values).ravel()


def _column(
    values: ArrayLike, name: str, unit: str, limit: float, source: str, motion: str = METRES
) -> Array:
    where = f'{source}: ' if source else ''
    try:
        column = values if _kept(values) else numbers(values)
    except (TypeError, ValueError) as error:
        raise InputError(f'{where}{name} is not a list of numbers ({error})') from error
    if column.ndim != 1:
        raise InputError(f'{where}{name} must be one-dimensional, got shape {column.shape}')
    # One pass where all is well: a NaN fails the comparison as well.
    if column.size and not max(column.max(), -column.min()) <= limit:
        bad = ~np.isfinite(column)
        if bad.any():
            raise InputError(
                f'{where}{name} has {int(bad.sum())} NaN or infinite samples, the first at sample '
                f'{int(bad.argmax())}; cut or repair the record before that sample'
            )
        at = int(np.abs(column).argmax())
        raise InputError(
            f'{where}{name} reaches '
            + spoken(f'{column[at]:g} {unit} at sample {at}, beyond {limit:g} {unit}', motion)
            + '; check the unit of this channel'
        )
    column.flags.writeable = False
    return column


def _of_unit(unit: str, known: Mapping[str, T], name: str) -> T:
    """Return what a table says of a unit.

    Raises:
        InputError: a unit that is not known.
    """
    if not isinstance(unit, str) or unit not in known:
        listed = ', '.join(u for u in known if u.isascii())
        raise InputError(f'{name} {unit!r} is not known; use one of {listed}')
    return known[unit]


def _universal(time: Any) -> Any:
    """Return a datetime without its zone, that of UTC; one that has none stays as it is."""
    ahead = time.utcoffset()
    return time if ahead is None else time.replace(tzinfo=None) - ahead


def _is_of_day(time: Any) -> bool:
    return hasattr(time, 'utcoffset') and hasattr(time, 'hour') and not hasattr(time, 'year')


def _of_day(time: Any) -> float:
    """Return a time of day in seconds."""
    return float(3600 * time.hour + 60 * time.minute + time.second + 1e-6 * time.microsecond)


def _clock(time: ArrayLike, source: str) -> tuple[float, int]:
    """Return the period [s] of times in seconds, of day or as datetimes, and the first one [ns].

    Raises:
        InputError: no list of times, or none of even steps.
    """
    where = source or 'time'
    masked = np.asarray(time.mask if isinstance(time, np.ma.MaskedArray) else False)
    if masked.any():
        raise InputError(
            f'{where}: time is masked at sample {int(np.ravel(masked).argmax())}: nobody knows '
            'when that was; leave such samples out at the ends, or cut the record there'
        )
    column = np.asarray(time)
    if column.ndim != 1:
        raise InputError(f'{where}: time must be one-dimensional, got shape {column.shape}')
    if column.dtype.kind == 'O' and len(column) and all(map(_is_of_day, column)):
        column = np.array([_of_day(t) for t in column])
    elif column.dtype.kind == 'O' and all(hasattr(t, 'utcoffset') for t in column):
        try:
            column = np.array([_universal(t) for t in column], dtype='datetime64[ns]')
        except (TypeError, ValueError, OverflowError) as error:
            raise InputError(
                f'{where}: time is no list of seconds or of datetimes ({error})'
            ) from error
    if column.dtype.kind == 'M':
        if np.isnat(column).any():
            raise InputError(f'{where}: time has no date at sample {np.isnat(column).argmax()}')
        stamps = column.astype('datetime64[ns]').astype(np.int64)
        first = int(stamps[0]) if len(stamps) else 0
        return uniform_period(1e-9 * (stamps - first).astype(np.float64), where), first
    if column.dtype.kind == 'm':
        column = column / np.timedelta64(1, 's')
    try:
        seconds = numbers(column)
    except (TypeError, ValueError) as error:
        raise InputError(
            f'{where}: time is no list of seconds or of datetimes ({error})'
        ) from error
    return uniform_period(seconds, where), max(round(float(seconds[0]) * 1e9), 0)


def check_stiffness(stiffness: float, source: str = '') -> float:
    """Return a specimen stiffness [N/m] that can be used.

    Raises:
        InputError: negative, not finite or above 1e12 N/m.
    """
    where = f'{source}: ' if source else ''
    value = number(stiffness, f'{where}specimen stiffness')
    if not 0.0 <= value <= MAX_STIFFNESS:
        raise InputError(
            f'{where}specimen stiffness {value:g} N/m is outside [0, {MAX_STIFFNESS:g}] N/m; '
            'give it in N/m (250 kN/m is 250e3), 0 for a free actuator'
        )
    return value


def source_name(source: str) -> str:
    """Return the last name of a source `folder/bag:/topic (record 1 of 2)`, folders left out."""
    path, mark, rest = source.partition(':/')
    return f'{path.rstrip("/").rpartition("/")[2]}{mark}{rest}'


def source_names(sources: Iterable[str]) -> dict[str, str]:
    """Return the shortest name of each source that tells it from the others, as people read it.

    That is its last name, with as many of its folders as another source of the same name needs;
    of one path that is written in several ways, each as it was given.
    """
    of = {source: _source_parts(source) for source in sources}
    written = Counter(of.values())
    used: dict[int, Counter[str]] = {}

    def name(parts: tuple[str, ...], folders: int) -> str:
        return '/'.join(parts[-2 - folders : -1]) + parts[-1]

    def taken(called: str, folders: int) -> bool:
        if folders not in used:
            used[folders] = Counter(name(parts, folders) for parts in written)
        return used[folders][called] > 1

    found: dict[str, str] = {}
    for source, parts in of.items():
        folders = 0
        while folders < len(parts) - 2 and taken(name(parts, folders), folders):
            folders += 1
        found[source] = source if written[parts] > 1 else name(parts, folders)
    return found


def _source_parts(source: str) -> tuple[str, ...]:
    """Return folders and last name of a source, and last what stands behind its path."""
    path, mark, rest = source.partition(':/')
    path = _LAST_SLASHES.sub(r'\1', path)
    if not path:
        return '', source
    first, *others = path.split('/')
    parts = [first, *(part for part in others if part not in ('', '.'))]
    return (*(parts[1:] if parts[0] == '.' and parts[1:] else parts), mark + rest)


def check_period(period: float, source: str = '') -> float:
    """Return a sample period [s] that can be used.

    Raises:
        InputError: not finite or outside [1e-6, 10] s.
    """
    where = f'{source}: ' if source else ''
    period = number(period, f'{where}sample period')
    if not 1e-6 <= period <= 10.0:
        raise InputError(
            f'{where}sample period {period:g} s is outside [1e-6, 10] s; time is in seconds'
        )
    return period


def check_motion(motion: str, stiffness: float | None, source: str = '') -> str:
    """Return what moves, metres or another motion, that can have a specimen stiffness [N/m].

    Raises:
        InputError: neither 'm' nor one of `motion.WRITTEN`, or a stiffness of what does not move
            in metres.
    """
    where = f'{source}: ' if source else ''
    if motion != METRES and motion not in WRITTEN:
        raise InputError(
            f'{where}motion {motion!r} is unknown; use one of {", ".join((METRES, *WRITTEN))}'
        )
    if stiffness and motion != METRES:
        raise InputError(
            f'{where}the specimen stiffness is {stiffness:g} N/m, and the motion is in {motion}: '
            f'give 0 for a free actuator, or the mm per {motion} as `scale`, with `unit: mm`, in '
            'a channel map'
        )
    return motion


def check_hold(hold: str, source: str = '') -> Hold:
    """Return how a command runs between its samples.

    Raises:
        InputError: neither 'zoh' nor 'linear'.
    """
    if hold not in ('zoh', 'linear'):
        where = f'{source}: ' if source else ''
        raise InputError(f"{where}hold {hold!r} is unknown; use 'zoh' or 'linear'")
    return cast('Hold', hold)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Record:
    """One uniformly sampled test, SI units, arrays read-only.

    Attributes:
        command: commanded displacement u, shape (n,) [m].
        measured: measured displacement of the actuator, shape (n,) [m].
        period: sample period [s].
        stiffness: specimen stiffness k [N/m]; None where it is not known.
        force: measured actuator force, shape (n,) [N], or None.
        start_ns: acquisition time of the first sample [ns].
        first_index: running index of the first sample in its stream.
        hold: how the command runs between its samples.
        actuator: name of the actuator.
        source: file, bag or topic the record came from, for messages.
        motion: what command and measured are: 'm', or 'deg', 'counts', 'V', 'mA', '%', which stand
            where metres do as `motion` tells, and have a stiffness of 0 or none.

    Raises:
        InputError: fewer than two samples, unequal lengths, NaN, absurd values or period, or a
            stiffness in N/m of what does not move in metres.
    """

    command: Array
    measured: Array
    period: float
    stiffness: float | None = None
    force: Array | None = None
    start_ns: int = 0
    first_index: int = 0
    hold: Hold = 'zoh'
    actuator: str = 'actuator'
    source: str = ''
    motion: str = METRES

    def __post_init__(self) -> None:
        where = f'{self.source}: ' if self.source else ''
        put = object.__setattr__
        check_motion(self.motion, None, self.source)
        for name in ('command', 'measured'):
            column = _column(
                getattr(self, name), name, 'm', MAX_DISPLACEMENT, self.source, self.motion
            )
            put(self, name, column)
        if self.force is not None:
            put(self, 'force', _column(self.force, 'force', 'N', MAX_FORCE, self.source))
        lengths = [len(c) for c in (self.command, self.measured, self.force) if c is not None]
        if len(set(lengths)) != 1:
            raise InputError(f'{where}channels have different lengths {lengths}')
        if lengths[0] < 2:
            raise InputError(f'{where}{lengths[0]} sample(s); at least two are needed')
        put(self, 'period', check_period(self.period, self.source))
        check_hold(self.hold, self.source)
        if self.stiffness is not None:
            put(self, 'stiffness', check_stiffness(self.stiffness, self.source))
            check_motion(self.motion, self.stiffness, self.source)

    @classmethod
    def from_arrays(
        cls,
        time: ArrayLike,
        command: ArrayLike,
        measured: ArrayLike,
        force: ArrayLike | None = None,
        *,
        unit: str,
        force_unit: str = 'N',
        stiffness: float | None = None,
        hold: Hold = 'zoh',
    ) -> Record:
        """Return the record of a test whose channels are arrays, columns of a table or lists.

        Args:
            time: when each sample was taken, shape (n,): seconds, datetimes of numpy or pandas, or
                times of day. A column or a row of a matrix will do, here and below.
            command: commanded displacement, shape (n,) [unit].
            measured: measured displacement, shape (n,) [unit].
            force: measured actuator force, shape (n,) [force_unit]; None where there is none.
            unit: of both displacements, 'm', 'mm', 'um', 'cm' or 'in'; or of another motion,
                'deg', 'rad', 'counts', 'V', '%'.
            force_unit: 'N', 'kN', 'MN', 'lbf' or 'kip'; of an angle 'Nm' or 'kNm', too.
            stiffness: specimen stiffness [N/m], 0 for a free actuator; None where not known.
            hold: how the command runs between its samples, 'zoh' or 'linear'.

        Raises:
            InputError: times that are not even, a unit that is not known, and as `Record`.

        Example:
            >>> Record.from_arrays([0.0, 0.01, 0.02], [0, 1, 2], [0, 0, 1], unit='mm')
            Record(actuator: 3 samples at 100 Hz (0.03 s), stiffness not known, zoh)
        """
        moves = {of: (METRES, metres) for of, metres in LENGTH.items()} | MOTIONS
        motion, length = _of_unit(unit, moves, 'unit')
        forces = FORCE | TORQUES if motion == MOTIONS['deg'][0] else FORCE
        newton = _of_unit(force_unit, forces, 'force_unit')
        period, start_ns = _clock(_vector(time), '')
        channels = {'command': _vector(command), 'measured': _vector(measured)}
        if force is not None:
            channels['force'] = _vector(force)
        columns = {}
        for name, values in channels.items():
            try:
                column = numbers(values) * (newton if name == 'force' else length)
            except (TypeError, ValueError) as error:
                raise InputError(f'{name} is not a list of numbers ({error})') from error
            if column.ndim == 1 and len(column) != np.size(time):
                raise InputError(f'{name} has {len(column)} samples, time has {np.size(time)}')
            columns[name] = column
        return cls(
            command=columns['command'],
            measured=columns['measured'],
            period=period,
            stiffness=stiffness,
            force=columns.get('force'),
            start_ns=start_ns,
            hold=hold,
            motion=motion,
        )

    def __len__(self) -> int:
        return len(self.command)

    def __repr__(self) -> str:
        known = 'stiffness not known' if self.stiffness is None else f'{self.stiffness:g} N/m'
        force = '' if self.force is None else ', with force'
        force += '' if self.motion == METRES else f', in {self.motion}'
        return (
            f'Record({self.source or self.actuator}: {len(self)} samples at {self.rate:.6g} Hz '
            f'({self.duration:.4g} s), {known}, {self.hold}{force})'
        )

    @property
    def rate(self) -> float:
        """Sample rate [Hz]."""
        return 1.0 / self.period

    @property
    def duration(self) -> float:
        """Length of the record, samples times period [s]."""
        return len(self) * self.period

    @property
    def time(self) -> Array:
        """Time of each sample since the first, shape (n,) [s]."""
        return np.arange(len(self), dtype=np.float64) * self.period

    def stamp_ns(self, sample: int) -> int:
        """Acquisition time of one sample [ns]."""
        return self.start_ns + round(sample * self.period * 1e9)

    def slice(self, start: int, stop: int) -> Record:
        """Return samples start:stop as a record of its own (same stream index and clock).

        Raises:
            InputError: fewer than two samples remain, or what is no number of a sample.
        """
        start, stop = whole(start, 'start'), whole(stop, 'stop')
        start, stop, _ = slice(start, stop).indices(len(self))
        if (start, stop) == (0, len(self)):
            return self
        return replace(
            self,
            command=self.command[start:stop],
            measured=self.measured[start:stop],
            force=None if self.force is None else self.force[start:stop],
            start_ns=self.stamp_ns(start),
            first_index=self.first_index + start,
        )

    def known_stiffness(self) -> float:
        """Specimen stiffness [N/m].

        Raises:
            InputError: the record does not say.
        """
        if self.stiffness is None:
            where = f'{self.source}: ' if self.source else ''
            raise InputError(
                f'{where}specimen stiffness is not known; give it with --stiffness N/m, 0 for a '
                'free actuator; `calibrate --stiffness unknown` tells what holds without it, as '
                '`combinations` does in Python'
            )
        return self.stiffness

    def check_scale(self) -> None:
        """Refuse times and lengths that are in other units than they say.

        Raises:
            InputError: a sample rate or a stroke that no servo-hydraulic test has.
        """
        where = f'{self.source}: ' if self.source else ''
        # A rate from a column of times is off by a rounding error.
        if not SLOWEST_RATE <= 1.001 * self.rate <= 1.002 * FASTEST_RATE:
            raise InputError(
                f'{where}the sample rate is {self.rate:.4g} Hz, and no servo-hydraulic test is '
                f'sampled with less than {SLOWEST_RATE:g} Hz or more than '
                f'{FASTEST_RATE / 1e3:g} kHz; check the units: a column in milliseconds is named '
                'time_ms (`unit: ms` in a channel map), and a period is in seconds'
            )
        for name in ('command', 'measured'):
            stroke = float(np.ptp(getattr(self, name)))
            if stroke >= LONGEST_STROKE:
                if self.motion != METRES:
                    moves = spoken(f'{stroke:.4g} m', self.motion)
                    most = spoken(f'{LONGEST_STROKE:g} m', self.motion)
                    raise InputError(
                        f'{where}{name} moves over {moves}, and {most} are the most that is '
                        'taken; check the unit, or give a `scale` in a channel map'
                    )
                raise InputError(
                    f'{where}{name} moves over {stroke:.4g} m, and the longest servo-hydraulic '
                    f'actuators have {LONGEST_STROKE:g} m; check the units: a column in '
                    f'millimetres is named {name}_mm (`unit: mm` in a channel map), and arrays '
                    'are in metres'
                )

    def check_channels(self) -> None:
        """Refuse channels from which no actuator can be identified.

        Raises:
            InputError: a channel that does not move, measured displacement that is the command
                itself, units that cannot belong together, or no test has.
        """
        self.check_scale()
        where = f'{self.source}: ' if self.source else ''
        if np.ptp(self.command) == 0.0:
            raise InputError(f'{where}the command is constant; nothing can be identified from it')
        if np.ptp(self.measured) == 0.0:
            raise InputError(
                f'{where}the measured displacement is constant; check that its channel is '
                'connected'
            )
        if np.array_equal(self.command, self.measured):
            raise InputError(
                f'{where}measured displacement and command are the same, sample for sample; check '
                'which columns they are'
            )
        ratio = float(np.std(self.measured) / np.std(self.command))
        # A specimen that is far stiffer than the actuator's oil hardly lets it move.
        if not 0.02 / max((self.stiffness or 0.0) / STIFF, 1.0) < ratio < 50.0:
            raise InputError(
                f'{where}measured displacement has {ratio:.3g} times the spread of the command; '
                'check the units of both channels'
            )
