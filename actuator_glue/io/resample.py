"""Resampling from a jittered clock to even times, on request; its cost, and faults of stamps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Literal, TypeAlias, get_args

import numpy as np
import scipy

from actuator_glue.errors import InputError
from actuator_glue.even_times import (
    allowed_rates,
    between,
    near_whole_rate,
    rounding,
    span,
    told_rate,
    uniform_period,
)
from actuator_glue.given import number, one_of
from actuator_glue.io.lost_samples import refuse_lost
from actuator_glue.records import Array

By: TypeAlias = Literal['band-limited', 'lines']
# Samples per second that are wanted [Hz], and how where it is not band-limited.
Resample: TypeAlias = float | tuple[float, By]

# Of the mean rate of the samples. Straight lines fold what is faster into the band below it, and
# finer ones are the same; a finer command is one that is not cut at its samples.
_LEAST: dict[By, float] = {'band-limited': 0.1, 'lines': 0.8}
_MOST: dict[By, float] = {'band-limited': 10.0, 'lines': 2.0}
# Share of the command's spread beyond which an error of straight lines between even samples is
# reported.
_STRAIGHT = 2e-3
_LONGEST_STEP = 5.0  # median steps without a sample: beyond it is a gap, not jitter
_KEPT = 0.95  # share of its amplitude that a sine keeps in the reported band
# Stamps that stay within this many steps of an even clock, or within what they are rounded to, may
# be a log's, the samples being even; they are if that clock lowers the misfit between neighbours
# to less than this share, and no sample is missing.
_BESIDE = 5.0
_BETTER = 0.7
# Times are reported to be off if that causes this share of the misfit between neighbours, and they
# are off by more than this share of a step.
_FELT, _EXACT = 0.1, 1e-3
_FEWEST = 5  # samples: a cubic through four, and the one that it foretells
_LOOK = 20_000  # samples from which band and noise are told
_WINDOW = ('kaiser', 8.0)  # a ripple of 2e-4; scipy's own has 1e-3
_APART = 64  # samples between impulses, farther than any of them is felt
# A parabola's root mean square over its line, of what it is in the middle.
_OF_MIDDLE = np.sqrt(8.0 / 15.0)
# A parabola's mean square over its step, and its error over two steps at the sample between.
_WITHIN = _OF_MIDDLE / 4.0


@dataclass(frozen=True, slots=True)
class Resampled:
    """Channels at even times, and what that changed.

    Attributes:
        values: by role, the first sample at the time of the first one measured; without times.
        period: [s].
        by: how it was done.
        steps: shortest and longest step of the recorded clock, in words.
        band: frequency above which sines lost more than 5 % of their amplitude [Hz].
        error: root mean square of what straight lines miss between samples, by role, in the unit
            of the channel: from each sample and the line between its neighbours; noise counts in.
            Empty where no lines were drawn.
        noise: mean share of the variance of white noise that is left [1].
        late: root mean square by which stamps were off an even clock, where that was taken in
            place of them [s]; 0 where the stamps were taken.
        clock: that clock, in words, with the rates that the stamps allow where they repeat.
        jitter: root mean square by which the times that were taken may still be off [s].
        moved: error from that jitter at the velocities of the measured displacement, root mean
            square [m].
        cut: root mean square deviation of the command from straight lines between its even
            samples, where that matters [m]; else 0.
        finer: samples per second at which it would not matter [Hz]; 0 without such a rate.
    """

    values: dict[str, Array]
    period: float
    by: By
    steps: str
    band: float
    error: dict[str, float]
    noise: float
    late: float
    clock: str
    jitter: float
    moved: float
    cut: float
    finer: float

    def told(self) -> str:
        """Return what was done and lost, in a line."""
        how = 'by straight lines between' if self.by == 'lines' else 'band-limited, from'
        missed = ', '.join(
            f'{role} {1e6 * error:.3g} um' for role, error in self.error.items() if role != 'force'
        )
        between = f'between samples the lines miss {missed} (rms), ' if missed else ''
        line = (
            f'{self.name()} {how} samples that are {self.steps} apart: above {self.band:.2g} Hz '
            f'more than 5 % of an amplitude is lost, {between}and {100.0 * self.noise:.0f} % of '
            'the variance of noise is left'
        )
        if self.late:
            line += (
                f'; the samples are even and their stamps are not, by {1e3 * self.late:.2g} ms '
                f'(rms), so that an even clock was taken in place of them, {self.clock}'
            )
        if self.moved:
            line += (
                f'; the times may be off by {1e3 * self.jitter:.2g} ms (rms), which is '
                f'{1e6 * self.moved:.2g} um of noise at the velocities of this record'
            )
        if self.cut:
            line += (
                '; straight between its samples the command misses '
                f'{1e6 * self.cut:.2g} um (rms), which parameters will make up for'
            )
            line += f': --resample {self.finer:.0f} keeps it' if self.finer else ''
        return line

    def name(self) -> str:
        """Return what was done, in three words."""
        return f'resampled to {1.0 / self.period:.6g} Hz'


def rate_and_way(resample: Resample) -> tuple[float, By]:
    """Return the samples per second that are wanted [Hz], and how.

    Raises:
        InputError: no such rate, or no such way.
    """
    by: By = 'band-limited'
    rate: object = resample
    if isinstance(resample, tuple) and len(resample) == 2:
        rate, by = resample
    one_of(by, 'resampling by', get_args(By))
    found = number(rate, 'resample')
    if not 0.0 < found < np.inf:
        raise InputError(f'resample is {found:g}; give samples per second, more than 0')
    return found, by


def evenly(
    values: dict[str, Array], way: tuple[float, By] | None, where: str
) -> tuple[dict[str, Array], float, Resampled | None]:
    """Return channels at even times, their period [s], and what was resampled.

    Args:
        values: channels by role, each of shape (n,), with `time` [s].
        way: samples per second that are wanted where their clock is not even, and how.
        where: file, for messages.

    Returns:
        The channels as they are, and None, where their clock is even.

    Raises:
        InputError: it is not and there is no way, or as `resample_evenly`.
    """
    try:
        return values, uniform_period(values['time'], where), None
    except InputError:
        if way is None:
            raise
        made = resample_evenly(values, *way, where=where)
        return made.values, made.period, made


def resample_evenly(
    values: dict[str, Array], rate: float, by: By = 'band-limited', *, where: str
) -> Resampled:
    """Return channels at even times.

    Band-limited is a cubic spline through the samples, and a low-pass without phase where fewer
    samples are wanted than there are: both channels go through the same filter, so that their
    transfer function stays. Straight lines make no overshoot at steps.

    Args:
        values: channels by role, each of shape (n,), with `time` [s].
        rate: samples per second that are wanted.
        by: how.
        where: file, for messages.

    Raises:
        InputError: times that are no numbers, go back, or stand still where the samples are not
            even, or do not tell whose clock that is; a gap, or samples that are missing of even
            ones; or a rate far from that of the samples.
    """
    one_of(by, 'resampling by', get_args(By))
    time = values['time']
    if len(time) < _FEWEST:
        raise InputError(
            f'{where}: {len(time)} samples are too few to be resampled; at least {_FEWEST} are '
            'needed'
        )
    steps = np.diff(time)
    channels = {role: column for role, column in values.items() if role != 'time'}
    even, clock = _even_clock(time, channels, rate, where)
    if not np.isfinite(time).all() or not (steps.min() > 0.0 or len(even)):
        at = int((~(steps > 0.0)).argmax())
        raise InputError(
            f'{where}: time does not go up after sample {at}; sort the record, or cut it there'
        )
    typical = float(np.median(steps))
    mean = float(np.mean(np.diff(even) if len(even) else steps))
    at = int(steps.argmax())
    if not len(even) and steps[at] > _LONGEST_STEP * typical:
        raise InputError(
            f'{where}: {steps[at]:.4g} s without samples after sample {at}; nobody knows what '
            'happened there: cut the record there before it is resampled'
        )
    if not _LEAST[by] <= rate * mean <= _MOST[by]:
        raise InputError(
            f'{where}: there are {1.0 / mean:.4g} samples per second; resample to between '
            f'{_LEAST[by] / mean:.3g} and {_MOST[by] / mean:.3g} Hz, not {rate:g}'
        )
    taken = even if len(even) else time - time[0]
    interpolate = _lines if by == 'lines' else _band_limited
    jitter = _jitter(taken, channels['measured'])
    cut, finer = (0.0, 0.0) if by == 'lines' else _cut(taken, channels['command'], rate)
    return Resampled(
        values={role: interpolate(taken, column, rate) for role, column in channels.items()},
        period=1.0 / rate,
        by=by,
        steps=span(steps),
        band=_band(partial(interpolate, taken[:_LOOK]), taken[:_LOOK], rate),
        error={role: _WITHIN * _left_out(taken, column) for role, column in channels.items()}
        if by == 'lines'
        else {},
        noise=_noise(partial(interpolate, taken[:_LOOK]), len(taken[:_LOOK]), rate),
        late=float(np.std(time - time[0] - even)) if len(even) else 0.0,
        clock=clock,
        jitter=jitter,
        moved=jitter * _rms(_unlike(taken, channels['measured'])[1]),
        cut=cut,
        finer=finer,
    )


def at_times(time: Array, column: Array, at: Array, *, held: bool) -> Array:
    """Return a channel at other times [s]: held from each sample to the next, or straight.

    Args:
        time: of its samples, going up, shape (n,).
        column: shape (n,).
        at: shape (m,).
        held: whether a sample holds until the next one.
    """
    if not held:
        return np.asarray(np.interp(at, time, column))
    # A stamp that is printed a little early is still that of its own sample.
    early = 1e-6 * float(time[-1] - time[0]) / len(time)
    before = np.searchsorted(time, at + early, side='right') - 1
    return column[np.clip(before, 0, len(column) - 1)]


def _even_times(time: Array, rate: float) -> Array:
    return np.asarray(np.arange(int(time[-1] * rate * (1.0 + 1e-12)) + 1) / rate)


def _lines(time: Array, column: Array, rate: float) -> Array:
    return np.asarray(np.interp(_even_times(time, rate), time, column))


def _band_limited(time: Array, column: Array, rate: float) -> Array:
    spline = scipy.interpolate.CubicSpline(time, column)
    mean = (len(time) - 1) / float(time[-1])
    if rate > 0.999 * mean:
        return np.asarray(spline(_even_times(time, rate)))
    # Twice as many as there are samples, then only what fewer samples can hold.
    finer = int(np.ceil(2.0 * mean / rate))
    fine = spline(np.minimum(_even_times(time, rate * finer), time[-1]))
    return np.asarray(scipy.signal.resample_poly(fine, 1, finer, window=_WINDOW, padtype='line'))


def _cut(time: Array, command: Array, rate: float) -> tuple[float, float]:
    """Return the error of straight lines between a command's even samples, and a sufficient rate.

    The error falls with the square of the rate. Both are zero where it does not matter.
    """
    curve = scipy.interpolate.CubicSpline(time, command)
    at = _even_times(time, rate)
    if len(at) < 2:  # of very few samples
        return 0.0, 0.0
    ends = curve(at)
    middle = curve(at[:-1] + 0.5 / rate) - 0.5 * (ends[:-1] + ends[1:])
    missed = _OF_MIDDLE * _rms(middle)
    share = missed / (_STRAIGHT * max(float(np.std(command)), 1e-300))
    if share <= 1.0:
        return 0.0, 0.0
    mean = (len(time) - 1) / float(time[-1])
    finer = 10.0 * np.ceil(0.1 * rate * np.sqrt(share))
    return missed, float(finer) if finer <= _MOST['band-limited'] * mean else 0.0


def _band(interpolate: Callable[[Array, float], Array], time: Array, rate: float) -> float:
    """Return the frequency up to which sines keep their amplitude, by sines [Hz]."""
    top = 0.5 * min(rate, (len(time) - 1) / float(time[-1]))
    low, high = 0.0, top
    for _ in range(12):
        middle = 0.5 * (low + high)
        wave = 2.0 * np.pi * middle
        made = [interpolate(part(wave * time), rate) for part in (np.sin, np.cos)]
        turned = np.exp(-1j * wave * np.arange(len(made[0])) / rate)
        kept = abs(np.mean((made[1] + 1j * made[0]) * turned))
        low, high = (middle, high) if kept >= _KEPT else (low, middle)
    return low


def _noise(interpolate: Callable[[Array, float], Array], count: int, rate: float) -> float:
    """Return the mean variance of interpolated white noise of variance one, by impulses."""
    total, number, made = 0.0, 0, np.zeros(1)
    for shift in range(_APART // 8, _APART, _APART // 8):
        impulses = np.zeros(count)
        impulses[shift::_APART] = 1.0
        made = interpolate(impulses, rate)
        total += float(made @ made)
        number += int(impulses.sum())
    return min(total / max(number, 1) * count / len(made), 1.0)


def _unlike(time: Array, column: Array) -> tuple[Array, Array]:
    """Return each sample's deviation from the cubic through its four neighbours, and the velocity.

    The deviation is scaled to the noise of one sample: the cubic's own noise is divided out.
    """
    near = [time[k : len(time) - 4 + k] - time[2:-2] for k in (0, 1, 3, 4)]
    weights = []
    for i, own in enumerate(near):
        others = [other for j, other in enumerate(near) if j != i]
        weights.append(np.prod([-o / (own - o) for o in others], axis=0))
    values = [column[k : len(column) - 4 + k] for k in (0, 1, 3, 4)]
    between = np.sum([w * v for w, v in zip(weights, values, strict=True)], axis=0)
    size = np.sqrt(1.0 + np.sum(np.square(weights), axis=0))
    return (column[2:-2] - between) / size, (values[2] - values[1]) / (near[2] - near[1])


def _even_clock(
    time: Array, channels: dict[str, Array], rate: float, where: str
) -> tuple[Array, str]:
    """Return even times where the samples are even and only their stamps are not; else nothing.

    Such stamps stay near an even clock, and on that clock the command is smoother. The clock is
    told in words.

    Raises:
        InputError: stamps that stand still and allow clocks far apart, none of them at the rate
            that is asked for; or samples that are missing.
    """
    none = np.empty(0), ''
    if len(time) < 16 or not np.isfinite(time).all() or np.diff(time).min() < 0.0:
        return none
    index = np.arange(len(time))
    period, first = np.polyfit(index, time - time[0], 1)
    off = time - time[0] - first - period * index
    # A random walk of steps departs from any clock, a log returns to its own; stamps in whole
    # seconds are off theirs by a second at most.
    rounded = rounding(time)
    if period <= 0.0:
        return none
    stands = bool(np.diff(time).min() == 0.0)
    if float(np.abs(off).max()) > max(_BESIDE * period, 1.1 * rounded):
        if stands:  # neither these stamps nor an even clock can be taken
            refuse_lost(time, period * index, where)
        return none
    if stands:
        step, told = _repeated(time, rate, where)
        even = np.asarray(step * index)
        refuse_lost(time, even, where)
        return even, told
    step = near_whole_rate(float(period), len(time))
    # The rate that is asked for is the controller's where the stamps cannot tell the two apart.
    if abs(1.0 / rate - period) * len(time) < max(rounded, period):
        step = 1.0 / rate
    even = np.asarray(step * index)
    column = channels['command']
    if not _smooth(even, column) < _BETTER * _smooth(time, column):
        return none
    refuse_lost(time, period * index, where)
    return even, f'of {1.0 / step:.6g} Hz'


def _repeated(time: Array, rate: float, where: str) -> tuple[float, str]:
    """Return the period of even samples whose stamps stand still [s], and its clock in words.

    The rate that is asked for is the controller's where the stamps allow it.

    Raises:
        InputError: they do not, and do not tell the rate either.
    """
    allowed = allowed_rates(time)
    if allowed is None:
        raise InputError(
            f'{where}: time stands still, and no even clock gives such times; cut the record '
            'where they are wrong, or log with the clock of the controller'
        )
    near = told_rate(*allowed)
    told = f'(its times allow {between(*allowed)})'
    if allowed[0] < rate < allowed[1]:
        said = '' if near is not None else ', as asked for'
        return 1.0 / rate, f'of {rate:.6g} Hz{said} {told}'
    if near is None:
        raise InputError(
            f'{where}: its times allow a clock of {between(*allowed)}, and {rate:g} Hz is none '
            'of them: resample to the rate of the controller'
        )
    return 1.0 / near, f'of {near:.6g} Hz {told}'


def _smooth(time: Array, column: Array) -> float:
    if np.diff(time).min() <= 0.0:
        return np.inf
    return _rms(_unlike(time, column)[0])


def _jitter(time: Array, column: Array) -> float:
    """Return how far times may be off [s, root mean square], from misfits that grow with speed."""
    left, velocity = _unlike(time, column)
    basis = np.column_stack([np.ones(len(left)), velocity**2])
    scale = basis.max(axis=0)
    if not scale[1] > 0.0:
        return 0.0
    (_, weight), _ = scipy.optimize.nnls(basis / scale, left**2)
    jitter = float(np.sqrt(weight / scale[1]))
    share = jitter**2 * float(np.mean(velocity**2)) / float(np.mean(left**2))
    step = float(time[-1]) / (len(time) - 1)
    return jitter if share > _FELT and jitter > _EXACT * step else 0.0


def _left_out(time: Array, column: Array) -> float:
    """Return the root mean square of each sample against the line between its neighbours."""
    weight = (time[1:-1] - time[:-2]) / (time[2:] - time[:-2])
    line = (1.0 - weight) * column[:-2] + weight * column[2:]
    return _rms(column[1:-1] - line)


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))
