"""Effects of the measurement, judged at the rate the records were sampled with.

Grid and jitter live in single samples: means over many of them hide both.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from actuator_glue.diagnosis.measured import hum, measurement
from actuator_glue.diagnosis.measured.hum import Line
from actuator_glue.diagnosis.measured.measurement import Measured
from actuator_glue.diagnosis.scopes.one_record import OneRecord
from actuator_glue.diagnosis.selection import Selection
from actuator_glue.diagnosis.thresholds import NOISE_SHARE
from actuator_glue.diagnosis.trial import Trial
from actuator_glue.inference.least_squares import decimate
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.inference.least_squares.free_run import Model
from actuator_glue.records import Array


def find(data: Data, found: Selection, line: Line | None) -> tuple[Measured, ...]:
    """Return the measurement effects that are significant and material.

    An effect must be material in the samples as recorded; its rms is that of its remainder in the
    fitted samples.

    Args:
        data: counted samples.
        found: the effects of the motion, fitted to them.
        line: hum that was removed from the data before.
    """
    error = found.final.fit.error
    # Hum is judged with the effects found: Eq. (2) alone may leave so much that it is hidden.
    line = (
        replace(line, floor=float(error @ error) / len(error)) if line else hum.find(data, error)
    )
    if max(data.factors) == 1:
        return measurement.find(data, error, found.material, line)
    whole = data.as_recorded
    errors = whole.simulate(_model(data, found.final), found.final.fit.theta)[0]
    np.subtract(whole.target, errors, out=errors)  # as recorded they are large
    if line is not None:
        errors = hum.regressed(whole, errors, line)
    noise = float(np.sqrt(max(np.mean(errors**2) - found.left**2, found.noise**2)))
    material = max(NOISE_SHARE * noise, found.material)
    seen = measurement.find(whole, errors, material, line)
    return tuple(
        m if m.name == 'hum' else replace(m, rms=_left(m, data, whole.target - errors))
        for m in seen
    )


def _model(data: Data, final: Trial) -> Model:
    """Return the model that simulates the records as recorded."""
    if not isinstance(final.own, OneRecord):
        return final.model
    own = final.own
    pairs = zip(data.records, data.recorded, strict=True)
    records = tuple(whole for r, whole in pairs if any(r is o for o in own.records))
    return OneRecord(final.structure, own.own, records, data.recorded)


def _left(effect: Measured, data: Data, simulated: Array) -> float:
    """Rms that is left of an effect in means over samples [m]."""
    squares, total = 0.0, 0.0
    for part, count in zip(data.as_recorded.split(simulated), data.factors, strict=True):
        if effect.name == 'quantisation':
            step = effect.values[0]
            tooth = step * (np.round(part / step) - part / step)
            mean_square = float(np.mean(decimate.means(tooth, count) ** 2))
        else:  # independent from sample to sample
            mean_square = effect.rms**2 * float(np.sum(decimate.window(count) ** 2))
        squares, total = squares + len(part) / count * mean_square, total + len(part) / count
    return float(np.sqrt(squares / total))
