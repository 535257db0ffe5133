"""How noisy a displacement channel is, whatever moves and whatever the model lacks."""

from __future__ import annotations

import numpy as np

from actuator_glue.jit import njit
from actuator_glue.records import Array

_DIFFERENCE_GAIN = 70.0  # variance of the 4th difference of white noise of unit variance
_TAIL = 1e-4  # share of the command's power above its bandwidth
# Frequencies from which one density is estimated: it scatters by a tenth, an rms by half of that.
_BINS = 32
# Ratio to white noise from which on the noise counts as filtered: less may be harmonics of what
# the model lacks, on top of white noise, which must not be hidden from the alarm.
_FILTERED = 3.0


def white_noise(measured: Array) -> float:
    """Return the standard deviation of white sensor noise in a smooth signal (n,) [m].

    From fourth differences, which leave nothing of a motion well below the sample rate: a 10 Hz
    sine of 2 mm at 200 Hz leaves 20 um in the difference, which is 2 um of noise. Coloured
    noise is underestimated. Fewer than six samples give 0.
    """
    count = len(measured) - 4
    if count < 2:
        return 0.0
    return float(np.sqrt(_fourth_power(measured) / count / _DIFFERENCE_GAIN))


def sensor_noise(residual: Array, command: Array, white: float) -> float:
    """Return the standard deviation of white, filtered or coloured noise in a window [m].

    What a model lacks follows the command, so noise is looked for above twice the command's
    bandwidth only, in the residual, which has no motion to leak. The density of each octave is
    its median (over ln 2, for Gaussian noise): lines, as of hum and of harmonics, do not count.
    Below these frequencies, the density of the lowest octave is assumed.

    Args:
        residual: measured less simulated displacement, shape (n,) [m].
        command: of the same samples, shape (n,) [m].
        white: what `white_noise` says [m]; it is returned unless the spectrum says three times as
            much, and where too little of it lies above the command.
    """
    taper: Array = np.hanning(len(residual)).astype(np.float64)
    moved = np.cumsum(_power(command, taper))
    # In steps of one over the window's length.
    bandwidth = int(np.searchsorted(moved, (1.0 - _TAIL) * moved[-1]))
    power = _power(residual, taper)
    edge = max(2 * bandwidth, _BINS)
    if 2 * edge > len(power):
        return white
    found, begin = 0.0, 0
    while edge < len(power):
        density = float(np.median(power[edge : 2 * edge])) / np.log(2.0)
        found += density * (min(2 * edge, len(power)) - begin)
        begin = edge = 2 * edge
    coloured = float(np.sqrt(2.0 * found / len(residual) / np.sum(taper**2)))
    return coloured if coloured > _FILTERED * white else white


def _power(x: Array, taper: Array) -> Array:
    return np.asarray(np.abs(np.fft.rfft((x - x.mean()) * taper)) ** 2)


@njit
def _fourth_power(x: Array) -> float:
    """Return the sum of squares of fourth differences."""
    total = 0.0
    for i in range(4, len(x)):
        difference = x[i] - 4.0 * (x[i - 1] + x[i - 3]) + 6.0 * x[i - 2] + x[i - 4]
        total += difference * difference
    return total
