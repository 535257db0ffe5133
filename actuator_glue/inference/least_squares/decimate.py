"""Records sampled much faster than command and actuator move, brought to the rate they need.

Both channels pass the same linear-phase filter, so that a linear actuator relates what is left of
them exactly as it related them before; the command then runs linearly between its samples, and the
attenuation of a hold over one sample, or of a straight line over many, is compensated to fourth
order.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy

from actuator_glue.model import linear
from actuator_glue.records import Array, Record

# Samples per period of the fastest that command or actuator show: the straight line between two
# is then off by less than 1e-4 after its correction.
_PER_PERIOD = 12.0
_LEAST_PER_PERIOD = 8.0  # where a channel has no more readings
# Hz that stay in sight whatever moves: hum with its first overtone, and the dynamics of valves and
# conditioners in the catalogue.
_SEEN = 150.0
_TAIL = 1e-4  # share of a channel's power that may lie above its bandwidth: 1 % of its amplitude
_NOISE = 1e-2  # share of a channel's power that may be white noise
_COARSE = 1e-3  # s: what moves is slower
# Larger factors are multiples of four, so that part of them can be decimated (see Data.finer).
_WHOLE = 8
_STEPS = 24  # natural frequencies tried, a decade to either side of the motion's bandwidth
_DAMPINGS = (0.5, 0.9, 1.5)


def _coarse(record: Record) -> Record:
    """Return means over a millisecond."""
    size = max(1, int(_COARSE / record.period))
    count = len(record) // size
    u, y = (
        c[: count * size].reshape(count, size).mean(axis=1)
        for c in (record.command, record.measured)
    )
    return Record(u, y, size * record.period)


def motion_bandwidth(record: Record) -> float:
    """Return the frequency [Hz] above which 0.01 % of the power lies, in command or motion.

    A command of steps, of a controller slower than its recorder, reaches further than what the
    piston makes of it. White noise of a channel moves nothing and does not count.
    """
    coarse = _coarse(record)
    window, lowest = np.hanning(len(coarse)), len(coarse)
    for channel in (coarse.command, coarse.measured):
        power = np.abs(np.fft.rfft(scipy.signal.detrend(channel) * window)) ** 2
        noise = float(np.median(power)) / np.log(2.0)
        if noise * len(power) < _NOISE * power.sum():  # else the motion fills the band
            power -= noise
        above = np.cumsum(power[::-1])[::-1]
        lowest = min(lowest, int(np.flatnonzero(above > _TAIL * above[0])[-1]))
    return max(lowest, 1) / (len(coarse) * coarse.period)


def actuator_bandwidth(record: Record, near: float) -> float:
    """Return the natural frequency [Hz] of the second-order lag nearest to a record.

    Looked for within a decade of a frequency: a faster actuator follows what it is given, a
    slower one hides it.
    """
    coarse = _coarse(record)
    w, z = (
        g.ravel()
        for g in np.meshgrid(2.0 * np.pi * near * np.geomspace(0.1, 10.0, _STEPS), _DAMPINGS)
    )
    systems = np.stack([2.0 * z * w, w**2, w**2], axis=1)
    y = coarse.measured - coarse.measured.mean()
    miss = []
    for some in np.array_split(systems, len(systems) // 8):
        shapes = linear.respond(some, coarse.command, period=coarse.period)
        shapes = shapes - shapes.mean(axis=1, keepdims=True)
        power = np.einsum('mn,mn->m', shapes, shapes)
        miss += list(-((shapes @ y) ** 2) / np.maximum(power, 1e-300))
    return float(w[int(np.argmin(miss))] / (2.0 * np.pi))


def needed_rate(record: Record) -> float:
    """Return the sample rate [Hz] that what moves in a record needs."""
    moved = motion_bandwidth(record)
    return max(2.0 * _SEEN, _PER_PERIOD * max(moved, actuator_bandwidth(record, moved)))


def factor(record: Record) -> int:
    """Return by what factor a record may be decimated; large ones are multiples of four."""
    if record.rate < 4.0 * _SEEN:  # whatever moves
        return 1
    return _handy(int(record.rate / needed_rate(record) + 1e-9))


def factor_of_readings(record: Record, every: float) -> int:
    """Return by what factor a record is decimated that has a reading in some samples only.

    Values filled in between readings carry no information, and noise drawn out over many samples
    is not the noise of the likelihood. The motion keeps some samples a period.

    Args:
        record: what is measured in it filled between its readings.
        every: samples from one reading to the next.
    """
    room = record.rate / (_LEAST_PER_PERIOD * motion_bandwidth(record))
    return max(factor(record), _handy(int(min(every, room) + 1e-9)))


def _handy(count: int) -> int:
    """Return a factor of decimation that is one at least, and divides well."""
    return max(count, 1) if count <= _WHOLE else count - count % 4


def window(count: int) -> Array:
    """Return the filter of both channels, odd and of unit sum: means of means of `count`."""
    box = np.full(count, 1.0 / count)
    return np.convolve(box, box)


def _filtered(values: Array, taps: Array, count: int) -> Array:
    """Filter with odd, centred taps and take every `count`-th sample; the ends are held."""
    half = len(taps) // 2
    padded = np.concatenate([np.full(half, values[0]), values, np.full(half, values[-1])])
    at = -(-2 * half // count) * count
    # Zeros in front shift the first output to a multiple of the step.
    lead = np.concatenate([np.zeros(at - 2 * half), taps])
    out = scipy.signal.upfirdn(lead, padded, up=1, down=count)
    first = at // count
    return np.asarray(out[first : first + -(-len(values) // count)])


def means(values: Array, count: int) -> Array:
    """Return what `decimated` makes of a measured channel (n,): one value for `count` samples."""
    return _filtered(values, window(count), count)


def decimated(record: Record, count: int) -> Record:
    """Return a record with one sample for `count`, the first at the same time.

    The force is left out; decimated beside it, it is a record of its own
    (diagnosis/samples/force.py).
    """
    if count == 1:
        return record
    taps = window(count)
    # Over one sample: a hold is the mean of two neighbours but for its curvature; a line is not.
    held = np.convolve([0.0, 0.5, 0.5], np.array([-1.0, 14.0, -1.0]) / 12.0)
    inner = held if record.hold == 'zoh' else np.array([1.0, 10.0, 1.0]) / 12.0
    command = _filtered(record.command, np.convolve(taps, inner), count)
    bend = -np.convolve(command, [1.0, -2.0, 1.0])[1:-1]
    bend[[0, -1]] = 0.0
    twice = -np.convolve(bend, [1.0, -2.0, 1.0])[1:-1]
    twice[[0, -1]] = 0.0
    return replace(
        record,
        command=command + bend / 12.0 + twice / 90.0,
        measured=means(record.measured, count),
        period=count * record.period,
        force=None,
        hold='linear',
    )
