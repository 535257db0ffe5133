"""Where in time, frequency, displacement and velocity the unexplained residual lies."""

from __future__ import annotations

import numpy as np

from actuator_glue.diagnosis.score.scorer import splits_of
from actuator_glue.diagnosis.search.fitting_verdict import Decision
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.json_value import Json
from actuator_glue.records import Array


def _band(frequency: Array, excess: Array) -> list[float]:
    """Return the band that holds the middle 80 % of the structure's power [Hz]."""
    power = np.cumsum(np.maximum(excess, 0.0))
    if power[-1] <= 0.0:
        return []
    low, high = np.searchsorted(power, [0.1 * power[-1], 0.9 * power[-1]])
    return [round(float(frequency[low]), 2), round(float(frequency[high]), 2)]


def remaining(data: Data, error: Array, decision: Decision) -> Json:
    """Return how much structure is left, its limit, and where it lies in each record.

    Args:
        data: the fitting part.
        error: of the reported structure (N,) [m].
        decision: the verdict on it.
    """
    splits, errors, rows = splits_of(data, error), data.split(error), []
    outputs = data.split(data.target - error)
    speeds = data.split(np.abs(data.velocity(data.target - error)))
    for i, (record, part, e, y, velocity, t) in enumerate(
        zip(data.records, splits, errors, outputs, speeds, data.times, strict=True)
    ):
        excess = np.maximum(e**2 - part.noise**2, 0.0)
        total = float(excess.sum()) or 1.0
        cumulated = np.cumsum(excess)
        inner = np.searchsorted(cumulated, [0.1 * cumulated[-1], 0.9 * cumulated[-1]])
        slow = velocity < np.median(velocity)
        amplitude = np.abs(y - np.median(y))
        large = amplitude > np.median(amplitude)
        order = np.argsort(amplitude)
        ranked = np.cumsum(excess[order])
        sizes = np.searchsorted(ranked, [0.1 * ranked[-1], 0.9 * ranked[-1]])
        rows.append(
            {
                'source': record.source or f'record {i + 1}',
                'stiffness': record.known_stiffness(),
                'structure': part.structure,
                'noise': part.noise,
                'frequency_hz': _band(part.frequency, part.excess),
                'time_s': [round(float(t[min(j, len(t) - 1)]), 2) for j in inner],
                'displacement': [float(amplitude[order[min(j, len(y) - 1)]]) for j in sizes],
                'share_at_low_velocity': round(float(excess[slow].sum()) / total, 3),
                'share_at_large_displacement': round(float(excess[large].sum()) / total, 3),
            }
        )
    return {'left': decision.left, 'limit': decision.limit, 'unit': 'm', 'records': rows}
