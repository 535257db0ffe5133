"""Effects of the measurement that leave no mean response: grid and jitter (hum: hum.py).

quantisation: the values lie on a grid, or the error is a sawtooth of position. timing-jitter:
variance that follows the squared velocity at frequencies where the mean response has nothing.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import scipy

from actuator_glue.diagnosis.measured.hum import Line
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.records import Array, Record

_ROUNDING = 1e-6  # of a step: values are written with so many digits
_PIECE = 1 << 18  # samples filtered at a time: of a long record only means are kept
_FADE = 256  # samples after which the filter has forgotten, to the last digit, where it began
_CLEAR_STEP = 60.0  # of the median power, as for a line in time (hum.py)


@dataclass(frozen=True)
class Measured:
    """A measurement effect and how large it is.

    Attributes:
        name: name in the catalogue.
        rms: error it causes [m].
        nats: evidence.
        values: its parameters in the catalogue's order.
        stddev: their standard deviations.
    """

    name: str
    rms: float
    nats: float
    values: tuple[float, ...]
    stddev: tuple[float, ...]


def grid(record: Record) -> float:
    """Return the spacing of the measured values [m]; 0 where they lie on no coarse grid."""
    most = len(record) // 4
    if len(np.unique(record.measured[::3])) > most:
        return 0.0
    values = np.unique(record.measured)
    if len(values) < 2 or len(values) > most:
        return 0.0
    gaps = np.diff(values)
    gaps = gaps[gaps > 1e-6 * (values[-1] - values[0])]
    step = float(np.median(gaps[gaps < 1.5 * gaps.min()]))
    # Refine on all values, then ask whether they are multiples.
    for _ in range(3):
        counts = np.round((values - values[0]) / step)
        step = float((counts @ (values - values[0])) / (counts @ counts))
    off = (values - values[0]) / step - np.round((values - values[0]) / step)
    return step if float(np.abs(off).max()) < 0.1 else 0.0


def quantisation(data: Data) -> Measured | None:
    """Return quantisation by the step of the grid that the values lie on; None without a grid."""
    steps = [grid(r) for r in data.records]
    if min(steps) <= 0.0:
        return None
    step, nats, knowledge = float(np.median(steps)), 0.0, 0.0
    for record, own in zip(data.records, steps, strict=True):
        values = record.measured - record.measured.min()
        counts = np.round(values / own)
        off = np.maximum(np.abs(values / own - counts), _ROUNDING)
        # Likelihood of values this close to the grid, against anywhere between its lines.
        nats += len(values) * float(np.log(0.5 / off.max()))
        knowledge += float(np.sum((counts - counts.mean()) ** 2) / np.mean((own * off) ** 2))
    return Measured('quantisation', step / np.sqrt(12.0), nats, (step,), (knowledge**-0.5,))


def _cuts(samples: int) -> list[slice]:
    return [slice(begin, begin + _PIECE) for begin in range(0, samples, _PIECE)]


def staircase(data: Data, errors: Array, simulated: Array) -> Measured | None:
    """Return quantisation with noise added after it, which shows as an error periodic in position.

    Rounding adds the sawtooth d (round(y/d) - y/d) of the noise-free position y, whose first
    harmonic over y has the amplitude d/pi: a period and an amplitude that must agree.
    """
    parts = list(zip(data.split(errors), data.split(simulated), strict=True))
    reach = max(float(np.ptp(y)) for _, y in parts)
    bins = 1 << 13
    cell = 2.0 * reach / bins  # padded to twice the range: periods are resolved by half a cycle
    power = np.zeros(bins // 2 + 1)
    for e, y in parts:
        total, mean, lowest = np.zeros(bins), e.mean(), y.min()
        for piece in _cuts(len(e)):
            at = np.minimum(((y[piece] - lowest) / cell).astype(np.int64), bins - 1)
            total += np.bincount(at, e[piece] - mean, bins)
        power += np.abs(np.fft.rfft(total)) ** 2
    density = np.fft.rfftfreq(bins, cell)
    level = scipy.ndimage.median_filter(power, 201, mode='reflect') + 1e-300
    inside = (density > 20.0 / reach) & (density < 0.15 / cell)
    ratio = np.where(inside, power / level, 0.0)
    at = int(np.argmax(ratio))
    if ratio[at] < _CLEAR_STEP:
        return None

    def amplitude(inverse: float) -> float:
        turns = 2j * np.pi * inverse
        sums = [abs(sum(e[p] @ np.exp(turns * y[p]) for p in _cuts(len(e)))) for e, y in parts]
        return float(2.0 * np.sum(sums) / len(errors))

    inverse = float(density[at])
    for width in (0.5, 0.1, 0.02):
        tried = inverse + np.linspace(-1.0, 1.0, 21) * width / reach
        inverse = float(tried[int(np.argmax([amplitude(v) for v in tried]))])
    step, first = 1.0 / inverse, amplitude(inverse)
    if not 0.5 < first * np.pi / step < 1.5:
        return None
    rms = step / np.sqrt(12.0)
    floor = max(float(np.mean(errors**2)) - rms**2, 1e-30)
    nats = 0.5 * len(errors) * float(np.log1p(0.5 * first**2 / floor))
    spread = step**2 * np.sqrt(6.0 * floor / len(errors)) / (np.pi * first * reach)
    return Measured('quantisation', rms, nats, (step,), (float(spread),))


def _pieces(samples: int, size: int) -> Iterator[tuple[slice, slice]]:
    """Yield which samples to filter at a time, and which of those to keep: whole blocks."""
    stop = samples // size * size
    step = max(1, _PIECE // size) * size
    for begin in range(0, stop, step):
        end, first = min(begin + step, stop), max(0, begin - _FADE)
        yield slice(first, end + size + _FADE), slice(begin - first, end - first)


def jitter(data: Data, errors: Array, simulated: Array) -> Measured | None:
    """Return timing jitter: high-frequency variance growing with the squared velocity.

    Above a third of the sample rate neither the mean response nor its first harmonics reach;
    independent errors of the sample times do.
    """
    tops, speeds = [], []
    sos = scipy.signal.butter(6, 0.6, 'highpass', output='sos')
    rows = zip(data.split(errors), data.split(simulated), data.periods, strict=True)
    for error, y, period in rows:
        # Means over 0.25 s: the variance needs averaging, the speed stays.
        size = max(8, round(0.25 / period))
        for wide, kept in _pieces(len(error), size):
            top = scipy.signal.sosfiltfilt(sos, error[wide])[kept] ** 2 / 0.4
            speed = np.gradient(y[wide], period)[kept] ** 2
            tops.append(top.reshape(-1, size).mean(axis=1))
            speeds.append(speed.reshape(-1, size).mean(axis=1))
    top, speed = np.concatenate(tops), np.concatenate(speeds)
    basis = np.stack([np.ones_like(speed), speed])
    weights = 1.0 / np.maximum(np.median(top), 1e-30) * np.ones_like(top)
    slope = np.zeros(2)
    for _ in range(4):  # the scatter of a variance is proportional to it
        w = basis * weights**2
        slope = np.linalg.solve(w @ basis.T, w @ top)
        weights = 1.0 / np.maximum(slope @ basis, 0.2 * np.median(top))
    if slope[1] <= 0.0:
        return None
    covariance = np.linalg.inv((basis * weights**2) @ basis.T)
    scatter = float(np.mean(((top - slope @ basis) * weights) ** 2))
    z = float(slope[1] / np.sqrt(covariance[1, 1] * scatter))
    deviation = float(np.sqrt(slope[1]))
    rms = deviation * float(np.sqrt(np.mean(speed)))
    return Measured(
        'timing-jitter', rms, 0.5 * z * z, (deviation,), (0.5 * deviation / max(z, 1e-9),)
    )


def find(
    data: Data, errors: Array, material: float, line: Line | None = None
) -> tuple[Measured, ...]:
    """Return the measurement effects that are significant and material.

    Args:
        data: counted samples.
        errors: residual of the final structure (N,) [m].
        material: rms above which an effect matters [m].
        line: hum that was found in the data.
    """
    hum = Measured('hum', line.rms, line.nats, line.values, line.stddev) if line else None
    simulated = data.target - errors
    found = (
        quantisation(data) or staircase(data, errors, simulated),
        hum,
        jitter(data, errors, simulated),
    )
    return tuple(m for m in found if m is not None and m.rms >= material and m.nats >= 25.0)
