"""A stationary line in the residual that the command does not have: hum of the mains.

It has no mean response, so it must not count as noise that hides smaller effects: it is taken out
of the fitting records before any effect is sought, each with its own phase.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy
from numpy.typing import NDArray

from actuator_glue.inference.least_squares.data import Data, Mask
from actuator_glue.records import Array, Record

# Least power of a line, over the level that a tenth of its neighbours exceed: 40 times the noise's
# mean, which one in 10^6 records of noise reaches.
_CLEAR = 18.0
_NEIGHBOURS, _EXCEEDED = 201, 90.0  # bins, percentile
_LOWEST = 2.0  # Hz
_PIECE = 1 << 20  # samples
_ORDERS = 9  # harmonics of a sinusoidal command that are its response, not hum
# Bins by which the frequency of a lasting sinusoid may be off; of it, all harmonics are excluded.
_STEADY = 0.05
_ALIKE = 0.99  # correlation of a command with itself one period later; its size may change


@dataclass(frozen=True)
class Line:
    """A line of one frequency with a phase of its own in each record.

    Attributes:
        frequency: [Hz].
        amplitudes: cosine and sine amplitude per record, (R, 2) [m].
        floor: mean square of what remains without it [m^2].
        size: counted samples.
        duration: longest record [s].
    """

    frequency: float
    amplitudes: Array
    floor: float
    size: int
    duration: float

    def same_as(self, other: Line) -> bool:
        """Whether both are one line, as far as the longest record tells frequencies apart."""
        return abs(self.frequency - other.frequency) * self.duration < 2.0

    @property
    def rms(self) -> float:
        """Rms of the line, mean over the records [m]."""
        return float(np.sqrt(0.5 * np.mean(np.sum(self.amplitudes**2, axis=1))))

    @property
    def nats(self) -> float:
        """Log-likelihood gained by the line, white noise."""
        return 0.5 * self.size * float(np.log1p(self.rms**2 / max(self.floor, 1e-30)))

    @property
    def values(self) -> tuple[float, float, float]:
        """Cosine and sine amplitude of the strongest record [m], frequency [Hz]."""
        first = self.amplitudes[int(np.argmax(np.sum(self.amplitudes**2, axis=1)))]
        return float(first[0]), float(first[1]), self.frequency

    @property
    def stddev(self) -> tuple[float, float, float]:
        """Standard deviations of `values` (Rife and Boorstyn 1974)."""
        spread = float(np.sqrt(2.0 * max(self.floor, 0.0) / self.size))
        line = float(np.sqrt(6.0 * max(self.floor, 0.0) / (np.pi**2 * self.size)) / self.duration)
        return spread, spread, line / max(float(np.hypot(*self.values[:2])), 1e-12)


def _basis(time: Array, frequency: float) -> Array:
    angle = 2.0 * np.pi * frequency * time
    return np.stack([np.cos(angle), np.sin(angle)])


def amplitudes(error: Array, time: Array, frequency: float) -> Array:
    """Least-squares cosine and sine amplitudes of a line (2,) [m]."""
    return _fitted([(time, error)], frequency)


def _fitted(pieces: Iterable[tuple[Array, Array]], frequency: float) -> Array:
    """As `amplitudes`, of times and errors piece by piece."""
    normal, along = np.zeros((2, 2)), np.zeros(2)
    for time, error in pieces:
        basis = _basis(time, frequency)
        normal += basis @ basis.T
        along += basis @ error
    return np.asarray(np.linalg.solve(normal, along))


def _peaks(error: Array, mask: Mask, record: Record) -> tuple[Array, Array]:
    """Frequencies and power over a level that few neighbours exceed, zero outside the usable band.

    The counted samples (N,) stand at their own times among the others, which are zero: spliced
    together, a line would change its phase at every seam. A command that is repeated moves the
    piston in regularly spaced lines: each bin must also stand out from the bins at the same place
    between two of these lines.
    """
    values = np.zeros(len(mask))
    values[mask] = scipy.signal.detrend(error)
    once = period(record.command)
    times = len(values) // once
    values = values[: times * once]
    spectrum = np.abs(np.fft.rfft(values * np.hanning(len(values)))) ** 2
    level = _level(spectrum)
    for place in range(times if times > 1 else 0):
        level[place::times] = np.maximum(level[place::times], _level(spectrum[place::times]))
    f = np.fft.rfftfreq(len(values), record.period)
    inside = (f > _LOWEST) & (f < 0.48 / record.period)
    return np.asarray(f), np.asarray(np.where(inside, spectrum / (level + 1e-300), 0.0))


def _level(spectrum: Array) -> Array:
    """Level that a tenth of the neighbours of each bin exceed."""
    return np.asarray(
        scipy.ndimage.percentile_filter(spectrum, _EXCEEDED, _NEIGHBOURS, mode='reflect')
    )


def _of_command(frequency: Array, command: Array, period: float) -> NDArray[np.bool_]:
    """Which frequencies are harmonics of lines of the command."""
    spectrum = np.abs(np.fft.rfft(scipy.signal.detrend(command) * np.hanning(len(command)))) ** 2
    f = np.fft.rfftfreq(len(command), period)
    # A sinusoid holds its power in three bins, a sweep or an earthquake in hundreds.
    strong = spectrum > 0.03 * spectrum.sum()
    bin_width = 1.0 / (len(command) * period)
    out = np.zeros(len(frequency), dtype=np.bool_)
    for order in range(1, _ORDERS + 1):
        for tone in f[strong]:
            out |= np.abs(frequency - order * tone) < order * 3.0 * bin_width
    # Friction answers a lasting sinusoid with harmonics of every order, each as sharp a line.
    for tone in _steady(spectrum, strong) * bin_width:
        order = np.maximum(np.round(frequency / tone), 1.0)
        out |= np.abs(frequency - order * tone) < (2.0 + order * _STEADY) * bin_width
    return out


def _steady(spectrum: Array, strong: NDArray[np.bool_]) -> Array:
    """Where sinusoids of constant frequency lie in a power spectrum under a Hann window [bins].

    By the larger neighbour of a peak (Grandke 1983).
    """
    edges = np.flatnonzero(np.diff(strong, prepend=False, append=False)).reshape(-1, 2)
    found = []
    for first, end in edges[np.diff(edges)[:, 0] <= 3]:
        at = first + int(np.argmax(spectrum[first:end]))
        if 0 < at < len(spectrum) - 1:
            side = 1 if spectrum[at + 1] >= spectrum[at - 1] else -1
            ratio = float(np.sqrt(spectrum[at + side] / spectrum[at]))
            found.append(at + side * (2.0 * ratio - 1.0) / (ratio + 1.0))
    return np.array(found)


def find(data: Data, errors: Array) -> Line | None:
    """Return a stationary line of the residual (N,) [m] that is none of the command's.

    Each record has its own phase: mains is not synchronous with a test.
    """
    best = (0.0, 0.0)
    parts = data.split(errors)
    for record, mask, error in zip(data.records, data.masks, parts, strict=True):
        f, ratio = _peaks(error, mask, record)
        ratio[_of_command(f, record.command, record.period)] = 0.0
        at = int(np.argmax(ratio))
        if ratio[at] > best[0]:
            best = (float(ratio[at]), float(f[at]))
    if best[0] < _CLEAR:
        return None
    frequency = best[1]

    def power(hertz: float) -> float:
        found = [amplitudes(e, t, hertz) for e, t in zip(parts, data.times, strict=True)]
        return float(sum(a @ a for a in found))

    for width in (0.5, 0.1, 0.02):
        tried = frequency + np.linspace(-1, 1, 21) * width / data.duration * 2
        frequency = float(tried[int(np.argmax([power(f) for f in tried]))])
    found = np.stack([amplitudes(e, t, frequency) for e, t in zip(parts, data.times, strict=True)])
    floor = float(np.mean(errors**2)) - 0.5 * float(np.mean(np.sum(found**2, axis=1)))
    return Line(frequency, found, floor, len(errors), data.duration)


def without(data: Data, line: Line) -> Data:
    """Take a line out of the measured displacement of all records."""
    records = []
    for record, amplitude in zip(data.records, line.amplitudes, strict=True):
        hum = amplitude @ _basis(record.time, line.frequency)
        records.append(replace(record, measured=record.measured - hum))
    return replace(data, records=tuple(records))


def regressed(data: Data, errors: Array, line: Line) -> Array:
    """Errors (N,) with the line's frequency regressed out of each record [m].

    Some samples at a time: cosines and sines of all would be twice a long record.
    """
    out = errors.copy()
    for period, runs in zip(data.periods, data.runs, strict=True):
        seen = ((time, out[at]) for time, at in _pieces(period, runs))
        amplitude = _fitted(seen, line.frequency)
        for time, at in _pieces(period, runs):
            out[at] -= amplitude @ _basis(time, line.frequency)
    return out


def _pieces(period: float, runs: Sequence[tuple[slice, slice]]) -> Iterator[tuple[Array, slice]]:
    """Yield the times of a record's counted samples, piece by piece, and where they lie joined."""
    for run, at in runs:
        for begin in range(0, run.stop - run.start, _PIECE):
            count = min(_PIECE, run.stop - run.start - begin)
            time = (run.start + begin + np.arange(count)) * period
            yield time, slice(at.start + begin, at.start + begin + count)


def period(command: Array) -> int:
    """Return after how many samples a command (n,) repeats itself; n where it does not.

    The first lag, up to half of the record, at which the correlation with itself is as high as at
    lag zero, after it has been negative.
    """
    u = command - np.mean(command)
    n, most = len(u), len(u) // 2
    length = scipy.fft.next_fast_len(2 * n, real=True)
    products = scipy.fft.irfft(np.abs(scipy.fft.rfft(u, length)) ** 2, length)[: most + 1]
    power = np.concatenate([[0.0], np.cumsum(u**2)])
    overlap = np.arange(n, n - most - 1, -1)
    early, late = power[overlap], power[n] - power[n - overlap]
    alike = products / np.sqrt(np.maximum(early * late, 1e-300))
    apart = np.flatnonzero(alike < 0.0)
    if not apart.size:
        return n
    after = alike[apart[0] :]
    again = np.flatnonzero(after > _ALIKE)
    if not again.size:
        return n
    # The top of the first peak, not its flank.
    end = again[0] + int(np.argmax(np.append(after[again[0] :] < _ALIKE, True)))
    return int(apart[0] + again[0] + np.argmax(after[again[0] : end]))
