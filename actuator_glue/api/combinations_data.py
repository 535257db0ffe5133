"""What is known of an actuator without the specimen's stiffness: Eq. (2)'s own combinations."""

from __future__ import annotations

from dataclasses import dataclass

from actuator_glue.api.calibration_parts import CalibratedRecord, FitError, Marginal
from actuator_glue.api.tracking import RecordTracking
from actuator_glue.diagnosis.verdict.residual_structure import ResidualStructure
from actuator_glue.records import Array, Record

# Of the transfer function of Eq. (2), b / (s^2 + a s + b + c), in the order of the draws.
COMBINATIONS = {
    'alpha_1_beta_0 / (alpha_2 + k)': '1/s^2',
    'beta_1 + alpha_3 k / (alpha_2 + k)': '1/s',
    'beta_1 alpha_3 k / (alpha_2 + k)': '1/s^2',
}


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class CombinationsData:
    """What is known of an actuator under a specimen of unknown stiffness.

    Attributes:
        combinations: posterior of each combination by name: those of the transfer function
            b / (s^2 + a s + b + c), and the parameters of effects.
        draws: shape (steps, chains, p), in their order.
        error: free-run error of the best draw.
        problems: why they must not be used as they stand; empty where they may.
        notes: what is not known, and what was done to the records.
        converged: R-hat of every combination is at most 1.01.
        effects: effects of the model beyond Eq. (2).
        sources: the records, described.
        records: the records themselves; empty after `load`.
        tracking: how the actuator follows the command of each record.
        evaluations: likelihood evaluations.
        seconds: how long it took.
        structure: what the residual holds beside noise; None where records are too short to tell,
            and in files of earlier versions.
        residuals: measured less the best draw, of each record whose start was let decay [m];
            empty after `load`.
        pull: force over displacement [N/m], which may be the stiffness; None where no force shows.
    """

    combinations: dict[str, Marginal]
    draws: Array
    error: FitError
    problems: tuple[str, ...]
    notes: tuple[str, ...]
    converged: bool
    effects: tuple[str, ...]
    sources: tuple[CalibratedRecord, ...]
    tracking: tuple[RecordTracking, ...]
    evaluations: int
    seconds: float
    records: tuple[Record, ...] = ()
    structure: ResidualStructure | None = None
    residuals: tuple[Array, ...] = ()
    pull: float | None = None

    @property
    def posterior(self) -> Array:
        """All draws, shape (m, p)."""
        return self.draws.reshape(-1, self.draws.shape[-1])
