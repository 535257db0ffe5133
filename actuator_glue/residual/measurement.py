"""Effects of the measurement that leave no mean response: grid, line, jitter.

quantisation: the values lie on a grid. hum: a line in the stationary spectrum that the command
does not have. timing-jitter: variance that follows the squared velocity at frequencies where the
mean response has nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage, signal

from actuator_glue.records import Array, Record
from actuator_glue.residual.data import Data


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
    values = np.unique(record.measured)
    if len(values) < 2 or len(values) > len(record) // 4:
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
    """Return the converter's step where the values lie on a grid."""
    steps = [grid(r) for r in data.records]
    if min(steps) <= 0.0:
        return None
    step = float(np.median(steps))
    evidence = float(sum(len(r) for r in data.records)) * 0.5
    return Measured(
        'quantisation', step / np.sqrt(12.0), evidence, (step,), (1e-3 * step / np.sqrt(12.0),)
    )


def _line_power(error: Array, time: Array, frequency: float) -> tuple[float, Array]:
    """Mean square that a sinusoid explains, and its cosine and sine amplitudes."""
    basis = np.stack([np.cos(2 * np.pi * frequency * time), np.sin(2 * np.pi * frequency * time)])
    amplitudes = np.linalg.solve(basis @ basis.T, basis @ error)
    return float(0.5 * (amplitudes @ amplitudes)), amplitudes


def hum(data: Data, errors: Array) -> Measured | None:
    """Return a stationary line of the residual that is not in the command.

    Each record has its own phase: mains is not synchronous with a test.
    """
    best: tuple[float, float] = (0.0, 0.0)
    parts = data.split(errors)
    for error, period in zip(parts, data.periods, strict=True):
        spectrum = np.abs(np.fft.rfft(signal.detrend(error) * np.hanning(len(error)))) ** 2
        level = ndimage.median_filter(spectrum, 201, mode='reflect') + 1e-300
        f = np.fft.rfftfreq(len(error), period)
        inside = (f > 2.0) & (f < 0.48 / period)
        ratio = np.where(inside, spectrum / level, 0.0)
        at = int(np.argmax(ratio))
        if ratio[at] > best[0]:
            best = (float(ratio[at]), float(f[at]))
    if best[0] < 60.0:  # 40 times the mean; one in 10^6 records of noise
        return None
    duration = max(r.duration for r in data.records)
    frequency = best[1]
    for width in (0.5, 0.1, 0.02):
        tried = frequency + np.linspace(-1, 1, 21) * width / duration * 2
        power = [
            sum(_line_power(e, t, f)[0] for e, t in zip(parts, data.times, strict=True))
            for f in tried
        ]
        frequency = float(tried[int(np.argmax(power))])
    found = [_line_power(e, t, frequency) for e, t in zip(parts, data.times, strict=True)]
    mean_square = float(np.mean([p for p, _ in found]))
    first = min(found, key=lambda p: -p[0])[1]
    floor = float(np.mean(errors**2)) - mean_square
    nats = 0.5 * len(errors) * np.log1p(mean_square / max(floor, 1e-30))
    spread = float(np.sqrt(2.0 * max(floor, 0.0) / len(errors)))
    line = float(np.sqrt(6.0 * max(floor, 0.0) / (np.pi**2 * len(errors))) / duration)
    line /= max(float(np.hypot(*first)), 1e-12)
    return Measured(
        'hum',
        float(np.sqrt(mean_square)),
        nats,
        (float(first[0]), float(first[1]), frequency),
        (spread, spread, line),
    )


def jitter(data: Data, errors: Array, simulated: Array) -> Measured | None:
    """Return timing jitter: high-frequency variance growing with the squared velocity.

    Above a third of the sample rate neither the mean response nor its first harmonics reach;
    independent errors of the sample times do.
    """
    tops, speeds = [], []
    rows = zip(data.split(errors), data.split(simulated), data.periods, strict=True)
    for error, y, period in rows:
        sos = signal.butter(6, 0.6, 'highpass', output='sos')
        top = signal.sosfiltfilt(sos, error) ** 2 / 0.4
        speed = np.gradient(y, period) ** 2
        # Means over 0.25 s: the variance needs averaging, the speed stays.
        size = max(8, round(0.25 / period))
        count = len(error) // size
        tops.append(top[: count * size].reshape(count, size).mean(axis=1))
        speeds.append(speed[: count * size].reshape(count, size).mean(axis=1))
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


def find(data: Data, errors: Array, material: float) -> tuple[Measured, ...]:
    """Return the measurement effects that are significant and material.

    Args:
        data: counted samples.
        errors: residual of the final structure (N,) [m].
        material: rms above which an effect matters [m].
    """
    found = (
        quantisation(data),
        hum(data, errors),
        jitter(data, errors, data.target - errors),
    )
    return tuple(m for m in found if m is not None and m.rms >= material and m.nats >= 25.0)
