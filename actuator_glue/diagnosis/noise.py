"""Split a residual into stationary noise and the rest, without a model of either.

Sensor and background noise, white or coloured, has the same spectrum at all times. What a wrong
model leaves follows the command through time and frequency. So at each frequency the median
over time of the residual's spectrogram is noise (for Gaussian noise the power is exponential,
its mean is its median / ln 2), and what exceeds it is structure.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import signal

from actuator_glue.records import Array

_WINDOW = 2.0  # s: a sweep stays near one frequency that long, and 1 Hz still has two periods


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
    """

    noise: float
    structure: float
    mean_square: float
    frequency: Array
    psd: Array
    excess: Array


def split(error: Array, period: float) -> Split:
    """Split the residual (n,) [m] of one record.

    Mean and linear trend count as structure: noise has none.
    """
    n = len(error)
    width = 2 * max(8, min(round(_WINDOW / period), n // 8) // 2)
    centred = signal.detrend(error)
    frequency, _, z = signal.stft(
        centred, 1 / period, 'hann', width, width // 2, boundary=None, scaling='psd'
    )
    power = np.abs(z) ** 2
    power[1:-1] *= 2.0
    level = np.median(power, axis=1) / np.log(2.0)
    # Real bins (0 and Nyquist) are chi-square of one degree, whose mean is median / 0.455.
    level[[0, -1]] *= np.log(2.0) / 0.4549
    total = power.mean(axis=1)
    mean_square = float(np.mean(error**2))
    whole = float(total.sum())
    share = float(level.sum()) / whole if whole > 0 else 0.0
    noise2 = min(share * float(np.mean(centred**2)), mean_square)
    return Split(
        noise=float(np.sqrt(noise2)),
        structure=float(np.sqrt(mean_square - noise2)),
        mean_square=mean_square,
        frequency=frequency,
        psd=np.maximum(level, 1e-12 * whole / len(level) + 1e-300),
        excess=total - level,
    )


def whitener(parts: list[Split]) -> Array:
    """Return the zero-phase whitening filter of noise with the mean density of `parts`.

    Convolved with noise of that density it gives unit variance per sample; all parts must come
    from records of one period and length class (equal frequency axes).
    """
    psd = np.mean([p.psd for p in parts], axis=0)
    # Smooth in frequency: the median over some 50 windows scatters by 20 %.
    kernel = np.hanning(7)[1:-1]
    kernel /= kernel.sum()
    smooth = np.exp(np.convolve(np.pad(np.log(psd), 2, mode='edge'), kernel, mode='valid'))
    rate = 2.0 * parts[0].frequency[-1]
    taps = np.fft.fftshift(np.fft.irfft(1.0 / np.sqrt(0.5 * rate * smooth)))
    return np.asarray(taps * np.hanning(len(taps) + 1)[:-1])


def whiten(rows: Array, taps: Array) -> Array:
    """Filter rows (..., n) with a zero-phase whitening filter, length kept.

    Beyond its ends a row goes on as it ended: with zeros there slow noise would leap at both ends,
    by many times what it moves from sample to sample.
    """
    half, count = len(taps) // 2, rows.shape[-1]
    longer = np.pad(np.atleast_2d(rows), ((0, 0), (half, half)), mode='edge')
    filtered = signal.oaconvolve(longer, taps[None, :], mode='valid', axes=-1)
    return np.asarray(filtered[:, -count:].reshape(rows.shape))
