"""Samples that are missing, or there twice, though the stamps seem those of an even clock."""

from __future__ import annotations

import numpy as np
import scipy

from actuator_glue import robust
from actuator_glue.errors import InputError
from actuator_glue.even_times import rounding
from actuator_glue.records import Array

# A lost sample moves all later stamps by a period, and for good: from one sample to the next the
# stamps step by so much, of so many stamps that those of their jitter are this many times smaller,
# and long behind it they are as far off those long before it.
_LOST = 0.6  # periods
_SURE = 6.0
_LATE = 11  # stamps, of which one late one must be fewer than half with those behind it
_FEW = 200  # samples of which one begins a hold-up, and not more
_SHARP = 3  # stamps on either side of a step at least
_AROUND = 50  # stamps on either side, too few for a clock of another rate to matter
# Stamps written more coarsely beat with the clock over some of them.
_COARSE, _BEATS = 0.25, 40  # of a period; stamps
# A log that is held up catches up in fewer than half of so many stamps.
_FOR_GOOD = 400
_BESIDE_HOLD = 150  # stamps between a hold-up and a loss that may be taken for each other
_LEAST_BEFORE, _LEAST_BEHIND = 20, 40  # stamps, at the ends of a record
_RETURNS = 0.25  # periods by which stamps fall back at the end: a log that still catches up
_TELLS_SLOPE = 100  # samples that tell the slope of a clock beside another
_PASSES = 12
_STEPS = 2000  # that are looked at, the largest
_ROUNDED = 1.02  # of a rounding step
_BLOCK = 100  # stamps of which the earliest and the latest are looked at


def refuse_lost(time: Array, even: Array, where: str) -> None:
    """Refuse an even clock for samples of which some are missing, or there twice.

    Args:
        time: stamps, (n,) [s].
        even: times by the clock, (n,) [s].
        where: file, for messages.

    Raises:
        InputError: from one sample to the next the stamps step away from the clock for good.
    """
    off, period, count = time - time[0] - even, float(even[1] - even[0]), len(time)
    if _least_range(even, off) <= _ROUNDED * rounding(time):
        return  # a clock beside the step of its stamps slips by one of them now and then
    stamped, rough = off, np.diff(off)
    # A stamp that came late holds up a few behind it; what is lost moves all of them.
    off = scipy.ndimage.median_filter(off, _LATE, mode='nearest')
    usual = np.sort(np.abs(np.diff(off)))[: -max(2, count // _FEW)]  # without hold-ups
    spreads = robust.deviation(rough), float(np.sqrt(np.mean(usual**2)))
    jitter = max(spreads) / np.sqrt(2.0)
    sharp = max(_SHARP, int(np.ceil(4.0 * (_SURE * jitter / (_LOST * period)) ** 2)))
    if rounding(time) > _COARSE * period:
        sharp = max(sharp, _BEATS)
    if sharp + _LEAST_BEFORE + _LEAST_BEHIND > count:
        return  # so few stamps that are off so far show no lost sample
    found = [_sharp_steps(kind, sharp, _LOST * period, jitter) for kind in (off, stamped)]
    steps = sorted({at for kind in found for at in kind})
    reach = max(_FOR_GOOD, 4 * sharp)
    lost = [(at, *_for_good(off, at, period, jitter, reach)) for at in steps]
    at, step, middle, slope = max(lost, key=lambda one: abs(one[1]), default=(0, 0.0, 0.0, 0.0))
    if not step:
        return
    close = [other for other in steps if _LATE < abs(other - at) <= _BESIDE_HOLD or other == at]
    if len(close) > 1:  # stamps come late, never early: those that are before a loss are below it
        part = np.arange(max(0, at - _BESIDE_HOLD), min(at + _BESIDE_HOLD, count))
        below = part[off[part] < middle + slope * (part - at)]
        if len(below):
            split = int(below[-1]) + 1 if step > 0.0 else int(below[0])
            at = min(close, key=lambda other: abs(other - split))
    width = max(sharp // 4, _SHARP)
    near = np.arange(max(0, at - 1 - width), min(at + width, count - 1))
    moved = rough[near] * np.sign(step)
    likely = near[moved >= moved.max() - max(jitter, rounding(time))]
    place = int(likely[np.abs(likely - (at - 1)).argmin()])
    what = 'missing' if step > 0.0 else 'there twice'
    # One late stamp looks like a lost one.
    beside = 'after' if jitter < 0.25 * period and len(close) == 1 else 'near'
    raise InputError(
        f'{where}: about {max(round(abs(step) / period), 1)} sample(s) are {what} {beside} sample '
        f'{place} ({time[place]:.9g} s): from there on the stamps are {1e3 * abs(step):.2g} ms '
        'off the even clock before; cut the record there, and give the parts as records of their '
        'own'
    )


def _sharp_steps(off: Array, size: int, least: float, jitter: float) -> list[int]:
    """Return where deviations step from one sample to the next: the first samples behind.

    Args:
        off: deviations from an even clock, (n,) [s].
        size: samples on either side out of which a step is told.
        least: the smallest that counts [s].
        jitter: standard deviation from one sample to the next [s].
    """
    sums = np.cumsum(np.append(0.0, off))
    at = np.arange(_LEAST_BEFORE, len(off) - _LEAST_BEHIND + 1)
    before, behind = np.minimum(at, size), np.minimum(len(off) - at, size)
    step = (sums[at + behind] - sums[at]) / behind - (sums[at] - sums[at - before]) / before
    # Stamps that wander, as of a log written in bursts, have many such steps.
    wander = robust.deviation(step, float(np.median(step)))
    spread = jitter * np.sqrt(1.0 / before + 1.0 / behind)
    beyond = np.abs(step) / np.maximum(least, _SURE * np.maximum(spread, wander))
    found, _ = scipy.signal.find_peaks(np.pad(beyond, 1), height=1.0, distance=size)
    found = found[np.argsort(-beyond[found - 1], kind='stable')][:_STEPS] - 1
    return [int(first) for first in np.sort(at[found])]


def _for_good(
    off: Array, at: int, period: float, jitter: float, reach: int
) -> tuple[float, float, float]:
    """Return by how much deviations stay behind a step, 0 where they come back [s]; its middle.

    The middle is that of the lines on both sides, [s] and [s per sample].

    A clock that slews, or runs at another rate than the mean one, moves on both sides alike.

    Args:
        off: deviations from an even clock, (n,) [s].
        at: the first sample behind the step.
        period: of the clock [s].
        jitter: standard deviation from one sample to the next [s].
        reach: samples on either side that are looked at.
    """
    nothing = 0.0, 0.0, 0.0
    before, behind = off[max(0, at - reach) : at], off[at : at + reach]
    apart = float(np.median(behind[:_AROUND]) - np.median(before[-_AROUND:]))
    usual = max(jitter, 0.05 * period)
    (first, slope), (last, backward) = _at_end(before, usual), _at_end(behind[::-1], usual)
    step = last - first
    if min(abs(apart), abs(step)) < _LOST * period or apart * step < 0.0:
        return nothing
    if len(behind) < reach:
        half = len(behind) // 2
        back = float(np.median(behind[:half]) - np.median(behind[half:]))
        back += half * slope if len(before) >= _TELLS_SLOPE else 0.0
        if back * np.sign(step) > _RETURNS * period:
            return nothing
    return step, 0.5 * (first + last), 0.5 * (slope - backward)


def _at_end(off: Array, usual: float) -> tuple[float, float]:
    """Return a line through some samples, which late ones hardly move: its end, and its slope.

    Args:
        off: deviations from an even clock, (n,) [s].
        usual: deviations from the line that count in full [s].
    """
    basis = np.column_stack([np.ones(len(off)), np.arange(1 - len(off), 1)])
    line = np.array([np.median(off), 0.0])
    for _ in range(_PASSES):
        weights = np.sqrt(usual / np.maximum(np.abs(off - basis @ line), usual))
        line, *_ = np.linalg.lstsq(basis * weights[:, None], off * weights, rcond=None)
    return float(line[0]), float(line[1])


def _least_range(even: Array, off: Array) -> float:
    """Return the range of deviations from the even clock that makes it least [s].

    Args:
        even: times by another clock, (n,) [s].
        off: deviations from it, (n,) [s].
    """
    begins = np.arange(0, len(off), _BLOCK)
    ends = np.concatenate([np.maximum.reduceat(off, begins), np.minimum.reduceat(off, begins)])
    at = np.tile(even[begins], 2)

    def spread(slope: float) -> float:
        return float(np.ptp(ends - slope * at))

    most = 2.0 * float(np.ptp(off)) / float(even[-1])
    found = scipy.optimize.minimize_scalar(
        spread, bounds=(-most, most), method='bounded', options={'xatol': 1e-6 * most}
    )
    return min(float(found.fun), spread(0.0))
