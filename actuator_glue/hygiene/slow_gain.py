"""How far a measured displacement follows slow motion: all the way, whatever the actuator."""

from __future__ import annotations

import numpy as np

from actuator_glue.records import Record

_SLOW = 0.05  # share of the command's power that is looked at, the slowest
_FEWEST = 3  # frequencies
_FOLLOWS = 0.8  # coherence squared, below which other motion, or noise, is in it
# An actuator that is too slow to follow lags: at half of the amplitude by 60 degrees (first order;
# of second order by more). A unit, or a transducer's factor, makes no lag.
_LAG = np.deg2rad(45.0)
# Factors by which channels in two units differ: inches for millimetres, centimetres, metres.
_UNITS = {25.4: 'inches and millimetres', 10.0: 'centimetres and millimetres'}
_NEAR = 0.15  # of a factor: an actuator's own gain beside it


def slow_gain(record: Record) -> float | None:
    """Return measured over commanded amplitude of the slowest motion, where no lag explains it.

    Eq. (2) follows slow motion all the way without a specimen, and nearly so against one; records
    of real machines show 0.96 to 1.03.

    Returns:
        None where the two do not move together, or the measured displacement lags.
    """
    window = np.hanning(len(record))
    u, y = (np.fft.rfft(window * (c - c.mean())) for c in (record.command, record.measured))
    power = np.abs(u) ** 2
    summed = np.cumsum(power)
    band = slice(0, max(_FEWEST, int(np.searchsorted(summed, _SLOW * summed[-1])) + 1))
    moved = float(power[band].sum())
    cross = complex(np.vdot(u[band], y[band]))
    follows = abs(cross) ** 2 > _FOLLOWS * moved * float(np.sum(np.abs(y[band]) ** 2))
    return abs(cross) / moved if follows and abs(np.angle(cross)) < _LAG else None


def told(gain: float) -> str:
    """Return a gain that no actuator has in words, with the units that it would be of."""
    factor = max(gain, 1.0 / gain)
    units = [names for of, names in _UNITS.items() if abs(factor / of - 1.0) < _NEAR]
    mixed = f' (as of {units[0]} in one unit)' if units else ''
    return (
        f'the measured displacement has {gain:.3g} times the amplitude of the command where that '
        f'is slow, without the lag of an actuator that is too slow{mixed}'
    )
