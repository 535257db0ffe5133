"""Frequency of a command at each sample."""

from __future__ import annotations

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.records import Array


def instantaneous_frequency(command: Array, period: float) -> Array:
    """Return the frequency of a command at each sample, shape (n,) [Hz].

    Half the reciprocal of the time between zero crossings of the command about its mean, taken
    at the middle of each half wave and joined by lines: defined for any command, exact for a
    sine, and within a half wave of the truth for a sweep. A crossing counts once the command
    has left a dead zone of 5 % of its rms, so that noise about zero is no frequency.

    Args:
        command: commanded displacement, shape (n,), any unit.
        period: sample period [s].

    Raises:
        InputError: the command crosses its mean fewer than twice.
    """
    centred = np.asarray(command, dtype=np.float64) - np.mean(command)
    dead = 0.05 * float(np.sqrt(np.mean(centred**2)))
    out = np.flatnonzero(np.abs(centred) > dead)
    turns = np.flatnonzero(np.diff(np.sign(centred[out])) != 0)
    if len(turns) < 2:
        raise InputError('the command crosses its mean fewer than twice: no frequency to speak of')
    left, right = out[turns], out[turns + 1]
    share = centred[left] / (centred[left] - centred[right])
    crossing = (left + share * (right - left)) * period
    middle = 0.5 * (crossing[1:] + crossing[:-1])
    frequency = 0.5 / np.diff(crossing)
    return np.asarray(np.interp(np.arange(len(centred)) * period, middle, frequency))
