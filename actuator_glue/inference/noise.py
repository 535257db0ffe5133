"""Split a residual into stationary noise and the rest, without a model of either.

Sensor and background noise, white or coloured, has the same spectrum at all times. What a wrong
model leaves follows the command through time and frequency. So at each frequency the median
over time of the residual's spectrogram is noise (for Gaussian noise the power is exponential,
its mean is its median / ln 2), and what exceeds it is structure. How well slow effects, an offset
or a drift, are known depends on the noise next to 0 Hz, which takes longer windows to see.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import scipy
from numpy.lib.stride_tricks import sliding_window_view

from actuator_glue.records import Array

_WINDOW = 2.0  # s: a sweep stays near one frequency that long, and 1 Hz still has two periods
_SLOW = 16.0  # s: windows for the density below a few of the others' bins, a quarter of n at most
_FINER = 4  # bins of the whitening filter in one of the spectrogram's
# Of the spectrogram's bins: below the first the slow density counts, beyond the second the other.
_BLEND = 1.5, 2.5
# Whitening: samples of a block, in lengths of the filter, and numbers that are worked on at once,
# which the processor's cache holds.
_FILTERS, _AT_ONCE = 8, 1 << 16


@dataclass(frozen=True)
class Split:
    """Noise and structure of one record's residual.

    Attributes:
        noise: rms of the stationary part [m].
        structure: rms of the rest [m]; 0 where the median exceeds the mean by chance.
        mean_square: mean square of the whole residual [m^2].
        frequency: (nf,) [Hz].
        psd: noise density (nf,) [m^2/Hz].
        excess: structure density, signed, (nf,) [m^2/Hz].
        slow: densities at low frequencies, from longer windows, as `frequency`, `psd`, `excess`.
    """

    noise: float
    structure: float
    mean_square: float
    frequency: Array
    psd: Array
    excess: Array
    slow: tuple[Array, Array, Array]

    def density(self, frequency: Array) -> Array:
        """Noise density at frequencies (k,), smoothed, (k,) [m^2/Hz]."""
        # The median over some 50 windows scatters by 20 %; over a few by more, and unevenly.
        psd, slow = np.exp(_smooth(np.log(self.psd), 5)), _smooth(self.slow[1], 7)
        below, beyond = _BLEND
        share = np.clip((beyond - frequency / self.frequency[1]) / (beyond - below), 0.0, 1.0)
        log_density = share * np.log(np.interp(frequency, self.slow[0], slow)) + (
            1.0 - share
        ) * np.log(np.interp(frequency, self.frequency, psd))
        return np.asarray(np.exp(log_density))

    def all_of_it(self) -> Split:
        """Return the split with all structure counted as noise."""
        frequency, psd, excess = self.slow
        return replace(
            self,
            psd=self.psd + np.maximum(self.excess, 0.0),
            slow=(frequency, psd + np.maximum(excess, 0.0), excess),
        )


def _smooth(values: Array, size: int) -> Array:
    """Smooth along frequency; beyond both ends a spectrum is its own mirror image."""
    kernel = np.hanning(size + 2)[1:-1]
    padded = np.pad(values, size // 2, mode='reflect')
    return np.convolve(padded, kernel / kernel.sum(), mode='valid')


def _densities(error: Array, period: float, width: int) -> tuple[Array, Array, Array]:
    """Frequencies [Hz] and densities of noise and of all that is in a residual (n,), (nf,)."""
    frequency, _, z = scipy.signal.stft(
        error, 1 / period, 'hann', width, width // 2, boundary=None, scaling='psd'
    )
    power = np.abs(z) ** 2
    # One-sided at 0 and Nyquist, too: half of it there would leak into what is smoothed.
    power *= 2.0
    level = np.median(power, axis=1) / np.log(2.0)
    # Real bins (0 and Nyquist) are chi-square of one degree, whose mean is median / 0.455.
    level[[0, -1]] *= np.log(2.0) / 0.4549
    return frequency, level, power.mean(axis=1)


class _Halves(NamedTuple):
    """Mean squares of a residual and of its noise [m^2], without its trend (n,), and densities."""

    mean_square: float
    noise2: float
    centred: Array
    densities: tuple[Array, Array, Array]


def _halves(error: Array, period: float) -> _Halves:
    n = len(error)
    width = 2 * max(8, min(round(_WINDOW / period), n // 8) // 2)
    centred = scipy.signal.detrend(error)
    densities = _, level, total = _densities(centred, period, width)
    mean_square = float(np.mean(error**2))
    # Both ends of the axis have half a bin.
    whole = float(np.trapezoid(total))
    share = float(np.trapezoid(level)) / whole if whole > 0 else 0.0
    noise2 = min(share * float(np.mean(centred**2)), mean_square)
    return _Halves(mean_square, noise2, centred, densities)


def structured(error: Array, period: float) -> float:
    """Return the mean square of the structure in a residual (n,) [m^2], as `split` finds it."""
    found = _halves(error, period)
    return found.mean_square - found.noise2


def split(error: Array, period: float) -> Split:
    """Split the residual (n,) [m] of one record.

    Mean and linear trend count as structure: noise has none.
    """
    n = len(error)
    mean_square, noise2, centred, (frequency, level, total) = _halves(error, period)
    longer = 2 * max(8, min(round(_SLOW / period), n // 4) // 2)
    low, below, all_below = _densities(centred, period, longer)
    near = low <= (_BLEND[1] + 2.0) * frequency[1]
    floor = 1e-12 * float(np.trapezoid(total)) / len(level) + 1e-300
    return Split(
        noise=float(np.sqrt(noise2)),
        structure=float(np.sqrt(mean_square - noise2)),
        mean_square=mean_square,
        frequency=frequency,
        psd=np.maximum(level, floor),
        excess=total - level,
        slow=(low[near], np.maximum(below[near], floor), (all_below - below)[near]),
    )


def whitener(part: Split) -> Array:
    """Return the zero-phase whitening filter of a record's noise.

    Convolved with that noise it gives unit variance per sample.
    """
    last = part.frequency[-1]
    density = part.density(np.linspace(0.0, last, _FINER * (len(part.frequency) - 1) + 1))
    taps = np.fft.fftshift(np.fft.irfft(1.0 / np.sqrt(last * density)))
    return np.asarray(taps * np.hanning(len(taps) + 1)[:-1])


@lru_cache(maxsize=64)  # many short rows are filtered one by one
def _gain(taps: bytes, size: int) -> Array:
    """Return the real spectrum of a zero-phase filter over `size` samples."""
    known, spread = np.frombuffer(taps), np.zeros(size)
    half = len(known) // 2
    spread[:half], spread[-half:] = known[half:], known[:half]
    return np.asarray(scipy.fft.rfft(spread).real)


def whiten(rows: Array, taps: Array) -> Array:
    """Filter rows (..., n) with a zero-phase whitening filter, length kept.

    Beyond its ends a row goes on as it ended: with zeros there slow noise would leap at both ends,
    by many times what it moves from sample to sample. Filtered in blocks that overlap by the
    filter's length, some at a time (overlap-save): the spectrum of a zero-phase filter is real.
    """
    half, count = len(taps) // 2, rows.shape[-1]
    table = rows.reshape(-1, count)
    blocks = -(-count // (_FILTERS * len(taps)))
    step = -(-count // blocks)
    size = scipy.fft.next_fast_len(step + 2 * half, real=True)
    gain = _gain(taps.tobytes(), size)
    out = np.empty((len(table), blocks * step))
    at_once = max(1, _AT_ONCE // (blocks * size))
    for some in (slice(i, i + at_once) for i in range(0, len(table), at_once)):
        part = table[some]
        longer = np.empty((len(part), (blocks - 1) * step + size))
        longer[:, :half], longer[:, half + count :] = part[:, :1], part[:, -1:]
        longer[:, half : half + count] = part
        spectra = scipy.fft.rfft(sliding_window_view(longer, size, axis=1)[:, ::step])
        spectra *= gain
        filtered = scipy.fft.irfft(spectra, size)[:, :, half : half + step]
        out[some].reshape(len(part), blocks, step)[:] = filtered
    return out[:, :count].reshape(rows.shape)
