"""The period of a command that repeats itself within a record: the motion then has lines."""

from __future__ import annotations

import numpy as np
import scipy

from actuator_glue.records import Array

_ALIKE = 0.99  # correlation of a command with itself one period later; its size may change


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
