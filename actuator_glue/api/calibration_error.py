"""What the best draw of a calibration leaves in each record: displacement and force."""

from __future__ import annotations

import numpy as np

from actuator_glue.api.calibration_parts import FitError, RecordError, RecordForce
from actuator_glue.api.ensemble import residual_of
from actuator_glue.inference.choice import ModelChoice
from actuator_glue.inference.predictive import ResidualModel
from actuator_glue.model.exact import Initial
from actuator_glue.model.force_errors import ForceErrors
from actuator_glue.model.structure import Structure
from actuator_glue.model.structure_errors import StructureErrors
from actuator_glue.records import Array, Record


def fit_error(
    model: ModelChoice, best: Array, records: list[Record], initial: Initial, settle: float
) -> FitError:
    """Return the error of the best draw, over all records and in each."""
    structure = Structure(model.effects)
    counts = [round(settle / r.period) for r in records]
    residuals = StructureErrors(structure, records, counts, initial).residuals(
        best[: len(structure.names)]
    )
    measured = [r.measured[n:] for r, n in zip(records, counts, strict=True)]
    whole = RecordError.of('', np.concatenate(residuals), np.concatenate(measured))
    each = (
        RecordError.of(r.source, e, y)
        for r, e, y in zip(records, residuals, measured, strict=True)
    )
    return FitError(whole.rms_m, whole.nrmse, tuple(each))


def left_over(
    model: ModelChoice, best: Array, records: list[Record], initial: Initial, settle: float
) -> ResidualModel | None:
    """Return the residual of the best draw as a model of noise; None for too few samples."""
    structure = Structure(model.effects)
    counts = [round(settle / r.period) for r in records]
    count = len(structure.names)
    errors = StructureErrors(structure, records, counts, initial)
    return residual_of(errors.residuals(best[:count]), count)


def force_errors(
    model: ModelChoice, best: Array, records: list[Record], initial: Initial, settle: float
) -> tuple[RecordForce, ...]:
    """Return what the best draw says of each record's force."""
    counts = [round(settle / r.period) for r in records]
    errors = ForceErrors(Structure(model.effects), records, counts, initial)
    return tuple(
        RecordForce.of(record.source, errors.simulated(best[np.newaxis], r), errors.measured[r])
        for r, record in enumerate(records)
    )
