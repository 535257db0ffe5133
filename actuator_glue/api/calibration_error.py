"""What the best draw of a calibration leaves in each record: displacement and force."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from actuator_glue.api.calibration_data import CalibrationData
from actuator_glue.api.calibration_parts import FitError, RecordError, RecordForce
from actuator_glue.model.exact import Initial
from actuator_glue.model.force_errors import ForceErrors
from actuator_glue.model.structure import Structure
from actuator_glue.model.structure_errors import StructureErrors
from actuator_glue.records import Array, Record


def residuals(
    structure: Structure, best: Array, records: Sequence[Record], initial: Initial, settle: float
) -> list[Array]:
    """Return what a draw leaves of each record behind its start, (n,) each [m].

    Args:
        structure: the model.
        best: the draw; parameters of a likelihood at its end are passed over.
        records: the tests.
        initial: state at their first samples.
        settle: uncounted start of each [s].
    """
    counts = [round(settle / r.period) for r in records]
    errors = StructureErrors(structure, records, counts, initial)
    return errors.residuals(best[: len(structure.names)])


def best_residuals(found: CalibrationData, most: int | None = None) -> list[Array]:
    """Return what the best draw leaves of the first of the records, as `residuals`."""
    records = found.records[:most]
    return residuals(Structure(found.effects), found.best, records, found.initial, found.settle)


def fit_error(records: Sequence[Record], left: Sequence[Array]) -> FitError:
    """Return the error over all records and in each, by what is left of them (n,) each [m]."""
    measured = [r.measured[-len(e) :] for r, e in zip(records, left, strict=True)]
    whole = RecordError.of('', np.concatenate(left), np.concatenate(measured))
    each = (
        RecordError.of(r.source, e, y) for r, e, y in zip(records, left, measured, strict=True)
    )
    return FitError(whole.rms_m, whole.nrmse, tuple(each))


def force_errors(
    structure: Structure, best: Array, records: Sequence[Record], initial: Initial, settle: float
) -> tuple[RecordForce, ...]:
    """Return what the best draw says of each record's force."""
    counts = [round(settle / r.period) for r in records]
    errors = ForceErrors(structure, records, counts, initial)
    return tuple(
        RecordForce.of(record.source, errors.simulated(best[np.newaxis], r), errors.measured[r])
        for r, record in enumerate(records)
    )
