"""From a column of times to one sample period, or a clear reason why not."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from actuator_glue.errors import InputError

Array: TypeAlias = NDArray[np.float64]

_DAY, _HOUR = 86_400.0, 3600.0  # s
# Counters of 31 or 32 bits in ns, us or ms, of 16 bits in ms, and seconds of a minute are full
# after so many [s].
_FULL = (60.0, 2.0**16 * 1e-3, *(2.0**b * u for b in (31, 32) for u in (1e-9, 1e-6, 1e-3)))
# A sample may lie this far off the uniform grid, in periods: rounded time stamps do.
_TOLERANCE = 0.25
# Share of the steps that far off their median above which a clock is uneven throughout: a few
# such steps are gaps.
_THROUGHOUT = 0.1
_DECIMALS = 6  # most digits behind the point to which stamps may have been rounded
# Rates closer than this are one rate to `clock_check`; a delay is off by the same share.
_ONE_RATE = 0.01
_TIES = 1e-6  # of a resolution: two stamps may be rounded from its two edges
_NEAR = 1.0  # periods off an even clock: a walk of uneven steps goes farther
_ENDS = 500  # stamps of each end that are compared: those far apart tell a rate best


def uniform_period(time: Array, where: str) -> float:
    """Return the period of uniformly sampled times [s].

    Rates that differ from a whole number of Hz by less than a twentieth of a sample over the
    whole record are taken as that number: the difference is rounding of the printed times.

    Args:
        time: times of the samples, shape (n,) [s].
        where: file, for messages.

    Raises:
        InputError: one sample, NaN, times that go back or stand still, a gap, jitter of more
            than a quarter of a period.
    """
    if len(time) < 2:
        raise InputError(f'{where}: {len(time)} sample(s); at least two are needed')
    bad = ~np.isfinite(time)
    if bad.any():
        raise InputError(f'{where}: time is NaN or infinite at sample {int(bad.argmax())}')
    steps = np.diff(time)
    back = steps <= 0.0
    if back.any():
        at = int(back.argmax())
        how, remedy = 'goes back', _where_back(steps, at)
        if steps[at] == 0.0:
            how, remedy = 'stands still', 'cut the record there'
            if not steps.any():
                raise InputError(
                    f'{where}: time stands still: all {len(time)} times are {time[0]:.13g} s, too '
                    'few digits to tell samples apart; give the time since the start, more '
                    'digits, or no times and the rate'
                )
            if steps.min() == 0.0 < steps.max():
                remedy += (
                    '; where the times are only rounded or those of a log, and the samples are '
                    f'even, {_even_instead(time)}'
                )
        raise InputError(
            f'{where}: time {how} at sample {at + 1} ({time[at]:.13g} s, then '
            f'{time[at + 1]:.13g} s); {remedy}'
        )
    typical = float(np.median(steps))
    period = float((time[-1] - time[0]) / (len(time) - 1))
    off = time - time[0]
    off -= period * np.arange(len(time))
    np.abs(off, out=off)
    at = int(off.argmax())
    rounded = rounding(time)
    if uneven(steps):
        # Stamps rounded to milliseconds lie within one of them of an even clock, jitter does not.
        if not off[at] <= rounded < period:
            near = near_rate(time)
            raise InputError(
                f'{where}: samples are not uniform in time: the clock is jittered, its steps are '
                f'{span(steps)}; a record has even steps: --resample {near} (in Python '
                f'`load(path, resample={near})`) makes them even, and tells what that '
                "costs; better log with the controller's clock"
            )
        return near_whole_rate(period, len(time), rounded)
    gap = int((steps > 1.5 * typical).argmax())
    # A step between 1.5 and 1.75 periods may be two rounded stamps; a longer one is a gap.
    if steps[gap] > (1.5 + _TOLERANCE) * typical:
        raise InputError(
            f'{where}: {steps[gap]:.4g} s without samples after sample {gap} ({time[gap]:.9g} s); '
            'cut the record there and give the parts as records of their own'
        )
    if off[at] > _TOLERANCE * period:
        raise InputError(
            f'{where}: samples are not uniform in time: sample {at} is {off[at] / period:.2g} '
            f'periods off an even clock; --resample {near_rate(time)} makes them even'
        )
    return near_whole_rate(period, len(time), rounded)


def _where_back(steps: Array, at: int) -> str:
    """Return what to do where times go back, by how far they do.

    Args:
        steps: differences of the times, shape (n - 1,) [s].
        at: which one is negative.
    """
    typical = float(np.median(steps))
    lost = typical - float(steps[at])
    if abs(lost - _DAY) < 1.0:
        return 'times of day pass midnight there: give the dates, too, or cut the record'
    near = 1.5 * abs(typical)
    if abs(lost - _HOUR) < near:
        return (
            'clocks are put back an hour there, or the times have no hours: give them with their '
            'zone, or in UTC, or cut the record'
        )
    if any(abs(lost - whole) < near for whole in _FULL):
        return (
            f'they begin anew, as a counter does that is full after {lost:.9g} s: add that to all '
            'times from there on, or cut the record'
        )
    return 'sort the record, or cut it there'


def _even_instead(time: Array) -> str:
    """Return how an even clock is taken in place of times that stand still, in words."""
    allowed = allowed_rates(time)
    near = None if allowed is None else told_rate(*allowed)
    rate = 'HZ' if near is None else f'{near:.10g}'
    how = f'--resample {rate} (in Python `load(path, resample={rate})`)'
    how += ' takes an even clock in place of them'
    if allowed is None:
        return f'{how}; which one they do not tell: give the rate of the controller'
    if near is None:
        return (
            f'{how}; they allow {between(*allowed)}, which is too wide for a proposal: give the '
            'rate of the controller'
        )
    return f'{how}: they allow {between(*allowed)}'


def between(low: float, high: float) -> str:
    """Return an interval of rates [Hz] in words, with the digits that tell its ends apart."""
    if high == np.inf:
        return f'{low:.3g} Hz and more'
    digits = 3 if high > 1.1 * low else min(int(np.ceil(2.0 - np.log10(high / low - 1.0))), 9)
    return f'{low:.{digits}g} to {high:.{digits}g} Hz'


def allowed_rates(time: Array) -> tuple[float, float] | None:
    """Return the lowest and the highest rate of even samples that can have these stamps [Hz].

    Stamps are taken to be late by less than what they are rounded to; those that cannot be, of a
    log that is written in bursts say, by less than the longest step between two of them. Each
    pair of stamps then bounds the time between its samples from below and from above.

    Args:
        time: stamps that never go back but may stand still, shape (n,) [s].

    Returns:
        None where no even clock gives such stamps, or nothing bounds its rate.
    """
    steps = np.diff(time)
    new = np.flatnonzero(steps > 0.0)
    if not new.size:
        return None
    # Only the first and the last sample of each stamp bound anything.
    begins, ends = np.append(0, new + 1), np.append(new, len(time) - 1)
    stamps = time[begins] - time[0]
    for late in (rounding(time), float(steps.max())):
        late *= 1.0 + _TIES
        shortest, longest = 0.0, np.inf
        for early, later in _compared(len(stamps)):
            apart = stamps[later] - stamps[early]
            outer, inner = ends[later] - begins[early], begins[later] - ends[early]
            ahead = inner > 0
            shortest = max(shortest, ((apart - late)[ahead] / inner[ahead]).max(initial=0.0))
            some = outer > 0
            longest = min(longest, ((apart + late)[some] / outer[some]).min(initial=np.inf))
        if late > 0.0 and shortest < longest < np.inf:
            return float(1.0 / longest), float(1.0 / shortest) if shortest else np.inf
    return None


def _compared(count: int) -> list[tuple[NDArray[np.intp], NDArray[np.intp]]]:
    """Return pairs of stamps to compare: each with itself and the next, the ends of both sides."""
    every, near = np.arange(count), min(count, _ENDS)
    early, later = np.meshgrid(every[:near], every[-near:])
    ahead = early < later
    return [(every, every), (every[:-1], every[1:]), (early[ahead], later[ahead])]


def told_rate(low: float, high: float) -> float | None:
    """Return the roundest rate between two that are one rate to any purpose; None if they are not.

    Args:
        low: least of them [Hz].
        high: greatest of them [Hz].
    """
    if not high < (1.0 + _ONE_RATE) * low:
        return None
    middle = 0.5 * (low + high)
    for digits in range(1, 17):
        near = float(f'{middle:.{digits - 1}e}')
        if low < near < high:
            return near
    return middle


def near_rate(time: Array) -> str:
    """Return the rate of the clock that times may have, as a text [Hz].

    Where they stay near an even clock it is the roundest rate that they cannot tell from that
    clock's, else a round number of samples per second near the mean one.
    """
    index = np.arange(len(time))
    passed = time - time[0]
    period, first = (float(c) for c in np.polyfit(index, passed, 1))
    off = passed - first - period * index
    rounded = rounding(time)
    if period > 0.0 and float(np.abs(off).max()) <= max(_NEAR * period, 1.1 * rounded):
        # A slope by least squares; stamps that are rounded are not off by chance.
        error = float(off.std()) * np.sqrt(12.0) / (period * len(time) ** 1.5)
        share = 3.0 * error + min(rounded / period, 1.0) / len(time)
        found = told_rate((1.0 - share) / period, (1.0 + share) / period)
        if found is not None:
            return f'{found:.10g}'
    rate = (len(time) - 1) / float(time[-1] - time[0])
    return f'{rate:.2g}' if rate < 99.5 else f'{round(rate, -1):.0f}'


def uneven(steps: Array) -> bool:
    """Return whether steps of a clock differ throughout, not at a few gaps alone.

    Args:
        steps: differences of ascending times, shape (n,).
    """
    typical = float(np.median(steps))
    odd = int(np.count_nonzero(np.abs(steps - typical) > _TOLERANCE * typical))
    return odd > max(1.0, _THROUGHOUT * len(steps))


def span(steps: Array) -> str:
    """Return the shortest and the longest step of a clock in words.

    Args:
        steps: differences of ascending times, shape (n,) [s].
    """
    ends = [1e3 * float(end) for end in (steps.min(), steps.max())]
    return ' to '.join(f'{end:.2g}' if end < 99.5 else f'{end:.0f}' for end in ends) + ' ms'


def rounding(time: Array) -> float:
    """Return the decimal step to which times are rounded [s]; 0 where they are not."""
    passed = time - time[0]
    for decimals in range(_DECIMALS + 1):
        scaled = passed * 10.0**decimals
        if float(np.abs(scaled - np.rint(scaled)).max()) < 1e-3:
            return float(10.0**-decimals)
    return 0.0


def near_whole_rate(period: float, samples: int, rounding: float = 0.0) -> float:
    """Return the period of a whole number of Hz if the samples cannot tell it from `period`.

    Args:
        period: mean step of the times [s].
        samples: how many there are.
        rounding: step to which the times are rounded [s].
    """
    whole = round(1.0 / period)
    if whole and abs(1.0 / whole - period) * samples < max(0.05 * period, min(rounding, period)):
        return 1.0 / whole
    return period
