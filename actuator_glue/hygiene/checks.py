"""Records refused before any calibration or diagnosis, as they cannot be what they say."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from actuator_glue.errors import InputError
from actuator_glue.hygiene.slow_gain import slow_gain, told
from actuator_glue.play import play
from actuator_glue.records import STIFF, Array, Record
from actuator_glue.velocity_command import is_velocity

_SMALLEST = 5e-6  # m of command, from end to end: below it is no test of an actuator
_LEAD = 5e-3  # s by which a measured displacement may lead (a compensated command)
_REACH = 0.5  # s of lag that is looked at
_FASTEST = 10.0  # m/s: no servo-hydraulic actuator follows
# A specimen that yields or hardens is off its stiffness by a factor of 2 or 3; a wrong unit is
# off by 10 and more.
_OFF = 5.0
# N/m: pushes back with 20 N over 10 mm, less than the seals of a piston rub.
_SOFTEST = 2e3
# Amplitude of slow motion that the most leakage of Table 3 leaves under 1 MN/m.
_DROOPS = 0.08
# Share by which a force that is well told may differ from the stated stiffness without a remark: a
# load cell's factor and a specimen's curvature are within it.
_BESIDE = 0.2
_TELLING = 0.8  # share of the force's variance that displacement and acceleration must explain
_SURE = 5.0  # standard deviations: noise of a load cell is not quite white
# One stiffness must explain so much of the force, and what bends or turns with the motion, as
# friction, a gap, hardening and yield, so little beside it: then small and large motion agree.
_ONE, _BENT = 0.9, 5e-4
_TURNS = 0.2  # of the spread of the velocity: friction turns within it
_TURNED = 0.01  # of the stroke, behind which friction has turned
_SEPARATE = 0.1  # share of the displacement's variance that acceleration must leave


def where(record: Record, number: int) -> str:
    """Return what to call a record in messages."""
    return record.source or f'record {number}'


def check(record: Record, number: int = 1) -> None:
    """Refuse a record that cannot be fitted.

    Raises:
        InputError: stiffness not known, at odds with the force or of no specimen; nothing
            moves, units that do not match, or channels that are swapped or of opposite sign.
    """
    name = where(record, number)
    record = replace(record, source=name)
    record.known_stiffness()
    _displaces(record)
    record.check_channels()
    reach = float(np.ptp(record.command))
    speed = float(np.quantile(np.abs(np.diff(record.command)), 0.99)) / record.period
    if reach < _SMALLEST or speed > _FASTEST:
        raise InputError(
            f'{name}: the command moves {reach:.3g} m in all, at up to {speed:.3g} m/s; check '
            'the units of its channel and of time (metres and seconds are expected)'
        )
    _follows(record)
    _reaches(record)
    _pushes(record)
    _resists(record)


def _displaces(record: Record) -> None:
    """Refuse a command of velocity or of a valve: no displacement follows from it by Eq. (2).

    Raises:
        InputError: the measured displacement follows the integral of the command.
    """
    if is_velocity(record.command, record.measured, record.rate):
        raise InputError(
            f'{record.source}: the measured displacement follows the integral of the command, as '
            'of a velocity or a valve; a displacement command is needed: record the set point of '
            'the position loop'
        )


def _follows(record: Record) -> None:
    """Refuse channels that are swapped or of opposite sign: an actuator follows its command.

    Raises:
        InputError: the measured displacement leads the command, or moves against it.
    """
    size = max(1, int(1e-3 / record.period))  # lags are looked at in milliseconds
    period = size * record.period
    u, y = (c - c.mean() for c in (_means(record.command, size), _means(record.measured, size)))
    cross = scipy.signal.correlate(y, u, method='fft') / np.sqrt(float(u @ u) * float(y @ y))
    reach = min(len(u) // 4, round(_REACH / period))
    near = cross[len(u) - 1 - reach : len(u) + reach]
    lags = np.arange(-reach, reach + 1) * period
    at = int(np.argmax(np.abs(near)))
    lead = -lags[at]
    # A periodic command has other peaks as high: then nothing can be said.
    peaks = scipy.signal.find_peaks(np.abs(near), height=0.9 * abs(near[at]))[0]
    if abs(near[at]) < 0.5 or len(peaks) > 1:
        return
    if near[at] < 0.0:
        raise InputError(
            f'{record.source}: the measured displacement moves against the command (correlation '
            f'{near[at]:.2f}); change the sign of one channel (`scale: -1` in a channel map)'
        )
    if lead > max(_LEAD, 2.0 * period):
        raise InputError(
            f'{record.source}: the measured displacement leads the command by '
            f'{1e3 * lead:.0f} ms; check whether the two channels are swapped, or their clocks '
            'apart'
        )


def _reaches(record: Record) -> None:
    """Refuse channels of two units: slow motion is followed nearly all the way.

    Raises:
        InputError: a fifth of it and less, or five times as much; under a specimen less than
            leakage explains.
    """
    gain = slow_gain(record)
    k = record.known_stiffness()
    # What leakage leaves of slow motion falls with the force that the specimen takes for it.
    least = 1.0 / (1.0 + (1.0 / _DROOPS - 1.0) * max(k / STIFF, 1.0)) if k else 1.0 / _OFF
    if gain is not None and not least < gain < _OFF:
        raise InputError(
            f'{record.source}: {told(gain)}; check the units of both channels (`unit` in a '
            'channel map, or in the name of the column)'
        )


def _means(values: Array, size: int) -> Array:
    """Return means of `size` samples each."""
    count = len(values) // size
    return np.asarray(values[: count * size].reshape(count, size).mean(axis=1))


def _slow(values: Array, record: Record) -> tuple[Array, Array]:
    """Return means over 10 ms, less their mean, and their second differences [unit, unit/s^2]."""
    size = max(1, round(0.01 / record.period))
    means = _means(values, size)
    second = np.gradient(np.gradient(means, size * record.period), size * record.period)
    return means - means.mean(), second - second.mean()


def _pushes(record: Record) -> None:
    """Refuse a stiffness that the recorded force contradicts: force over displacement shows it.

    Either sign of the force is taken: load cells differ. What does not explain the force, a
    channel that is not connected say, says nothing of the stiffness.

    Raises:
        InputError: the stiffness is off by a factor of five, or that of a free actuator where
            a specimen pushes back.
    """
    stated, found = record.known_stiffness(), _regressed(record)
    if found is None or not found.explained:
        return
    seen = abs(found.weight)
    share = max(seen, stated) * found.size
    if stated > 0.0:
        wrong = share > 0.1 and not 1.0 / _OFF < seen / stated < _OFF
    else:
        wrong = found.separate and share > 0.5 and not _rubs(record)
    if wrong:
        raise InputError(
            f'{record.source}: force over displacement is {seen:.3g} N/m, but the specimen '
            f'stiffness is given as {stated:.3g} N/m; check it (--stiffness, in N/m and in the '
            'order of the records) and the units of the force channel'
        )


def _rubs(record: Record) -> bool:
    """Whether a force explains more that turns with the motion and stays where that rests.

    Between two levels of a step test a piston's friction holds it where a specimen would.
    """
    assert record.force is not None
    x, acceleration = _slow(record.measured, record)
    force, _ = _slow(record.force, record)
    turned = x - play(x, _TURNED * float(np.ptp(x)), float(x[0]))
    rubbed = _left(force, [turned - turned.mean(), acceleration])
    return rubbed < _left(force, [x, acceleration])


def _left(force: Array, columns: Sequence[Array]) -> float:
    """Return the sum of squares of a force (n,) that columns of the motion leave."""
    basis = np.column_stack(columns)
    weights, *_ = np.linalg.lstsq(basis, force, rcond=None)
    return float(np.sum((force - basis @ weights) ** 2))


def _resists(record: Record) -> None:
    """Refuse a stiffness below that of any specimen: one in N/mm, kN/mm or kN/m.

    Raises:
        InputError: the actuator could not tell it from none.
    """
    stated = record.known_stiffness()
    if 0.0 < stated < _SOFTEST:
        raise InputError(
            f'{record.source}: the specimen stiffness is given as {stated:.4g} N/m, and no '
            f'specimen is softer than {_SOFTEST:g} N/m, which an actuator cannot tell from none; '
            'check its unit: it is in N/m (250 kN/m or 250 N/mm is 250e3), 0 for a free actuator'
        )


def pull(record: Record) -> float | None:
    """Return force over displacement [N/m], with its sign; None where that explains no force."""
    found = _regressed(record)
    return found.weight if found is not None and found.explained else None


def beside_stated(records: Sequence[Record]) -> list[str]:
    """Return a sentence on each record whose force tells another stiffness than was given.

    Only where one stiffness describes the force at all sizes of motion, a mass cannot stand behind
    it, and the difference is beyond what noise makes.
    """
    out = []
    for i, record in enumerate(records):
        stated, found = record.stiffness, _regressed(record)
        if not stated or found is None or not (found.explained and found.separate):
            continue
        seen = abs(found.weight)
        if abs(seen - stated) - _SURE * found.error > _BESIDE * stated and _is_one(record):
            out.append(
                f'{where(record, i + 1)}: force over displacement tells a specimen stiffness of '
                f'{seen:.3g} N/m, and {stated:.3g} N/m is given; small and large motion agree, so '
                'check which one holds (--stiffness, in N/m and in the order of the records), and '
                'the unit of the force channel'
            )
    return out


def _is_one(record: Record) -> bool:
    """Whether one stiffness describes the force: the slopes of small and large motion agree."""
    if record.force is None:
        return False
    x, acceleration = _slow(record.measured, record)
    force, _ = _slow(record.force, record)
    velocity = np.gradient(x)
    x, acceleration, velocity = (c / c.std() for c in (x, acceleration, velocity))
    straight = [np.ones(len(x)), x, acceleration, velocity]
    # A gap and hardening bend the curve; friction and yield turn with the motion.
    turning = np.tanh(velocity / _TURNS)
    bent = [x**2, x**3, np.abs(x) * x, turning, turning * np.abs(x), turning * x**2]
    whole = float(force @ force)
    one, other = (_left(force, c) / whole for c in (straight, [*straight, *bent]))
    by_chance = _SURE * len(bent) * other / max(len(x) - len(straight) - len(bent), 1)
    return one <= 1.0 - _ONE and one - other <= _BENT + by_chance


def most_push(record: Record) -> float | None:
    """Return the most that force over displacement can be where that explains no force [N/m].

    None where it explains the force, where a mass may hide it, and without a force that moves.
    """
    found = _regressed(record)
    if found is None or found.explained or not found.separate:
        return None
    return abs(found.weight) + _SURE * found.error


@dataclass(frozen=True, slots=True)
class _Regressed:
    """A force by displacement and acceleration.

    Attributes:
        weight: force over displacement [N/m].
        error: its standard deviation, of white noise [N/m].
        size: spread of the displacement over that of the force [m/N].
        separate: a mass could be told apart.
        explained: the two explain the force.
    """

    weight: float
    error: float
    size: float
    separate: bool
    explained: bool


def _regressed(record: Record) -> _Regressed | None:
    """Return what displacement and acceleration say of the force; None where one does not move."""
    if record.force is None or float(np.ptp(record.force)) == 0.0:
        return None
    x, acceleration = _slow(record.measured, record)
    force, _ = _slow(record.force, record)
    moves = min(float(acceleration @ acceleration), float(force @ force)) > 0.0
    if len(x) < 10 or not moves:
        return None
    # A mass's force must not pass for a specimen's, nor be subtracted from it where both look
    # alike.
    shared = float(x @ acceleration) ** 2 / float((x @ x) * (acceleration @ acceleration))
    separate = 1.0 - shared > _SEPARATE
    basis = np.stack([x, acceleration]) if separate else x[None]
    weights, *_ = np.linalg.lstsq(basis.T, force, rcond=None)
    left = float(np.sum((force - weights @ basis) ** 2))
    free = max(len(x) - len(basis), 1)
    return _Regressed(
        weight=float(weights[0]),
        error=float(np.sqrt(left / free * np.linalg.inv(basis @ basis.T)[0, 0])),
        size=float(x.std() / force.std()),
        separate=separate,
        explained=left <= (1.0 - _TELLING) * float(force @ force),
    )
