"""What a calibration found: what is known of each parameter, the draws, what limits their use."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from actuator_glue.api.calibration_parts import CalibratedRecord, FitError, Marginal, RecordForce
from actuator_glue.api.tracking import RecordTracking
from actuator_glue.diagnosis.verdict.residual_structure import ResidualStructure
from actuator_glue.errors import InputError
from actuator_glue.inference.at_bound import Pressed
from actuator_glue.inference.carried import Carried
from actuator_glue.inference.predictive import ResidualModel
from actuator_glue.inference.prior_use import PriorUse
from actuator_glue.model.exact import Initial
from actuator_glue.records import Array, Record

# Normal components of a prior, at most.
_COMPONENTS = 4


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class CalibrationData:
    """A joint posterior, and what forbids or limits its use.

    Attributes:
        parameters: posterior of each parameter by name.
        draws: draws after burn-in, shape (steps, chains, p), SI units.
        log_density: log likelihood of each draw, shape (steps, chains).
        best: draw of the highest likelihood, shape (p,).
        error: free-run error of the best draw.
        structure: what the residual holds beside noise; None where records are too short to tell,
            and in files of earlier versions.
        at_bound: parameters that a bound of the prior holds.
        problems: why the posterior must not be used as it stands; empty where it may.
        notes: what these records cannot tell, and what was done to them.
        prior: what was known before, beside the bounds; None where that was nothing.
        converged: R-hat of every parameter is at most 1.01.
        effects: effects of the model beyond Eq. (2).
        likelihood: 'glue', 'gaussian' or 'ar1'.
        shaping_factor: G of Eq. (4); None with a formal likelihood.
        automatic_shaping: G is half of the independent samples that the residual is worth.
        force: how the best draw explains each record's force; empty where that was no evidence.
        seed: seed of the sampler.
        sampler: 'adaptive' or 'published', see `CalibrationOptions`.
        initial: state at a record's first sample, 'rest' or 'measured'.
        settle: uncounted start of each record [s].
        evaluations: likelihood evaluations.
        seconds: how long it took, compilation left out.
        compile_seconds: compilation, which only the first use of an installation pays.
        sources: the records, described.
        records: the records themselves as they were fitted; empty after `load`.
        tracking: how the actuator follows the command of each record.
        residual: what the best draw leaves, as noise of which neighbouring samples are correlated;
            None where too few samples are left, and in files of earlier versions.
        sketches: stretches of what each record measured, by which a later calibration knows it
            again, each of shape (m, n) [m]; empty in files of earlier versions.
    """

    parameters: dict[str, Marginal]
    draws: Array
    log_density: Array
    best: Array
    error: FitError
    at_bound: tuple[Pressed, ...]
    problems: tuple[str, ...]
    notes: tuple[str, ...]
    converged: bool
    effects: tuple[str, ...]
    likelihood: str
    shaping_factor: float | None
    seed: int
    initial: Initial
    settle: float
    evaluations: int
    seconds: float
    compile_seconds: float
    sources: tuple[CalibratedRecord, ...]
    prior: PriorUse | None = None
    records: tuple[Record, ...] = ()
    tracking: tuple[RecordTracking, ...] = ()
    sampler: str = 'adaptive'
    automatic_shaping: bool = False
    force: tuple[RecordForce, ...] = ()
    structure: ResidualStructure | None = None
    residual: ResidualModel | None = None
    sketches: tuple[Array, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """Parameters in the order of the draws' columns."""
        return tuple(self.parameters)

    @property
    def posterior(self) -> Array:
        """Draws of all chains, shape (m, p), SI units."""
        return self.draws.reshape(-1, self.draws.shape[2])

    def check(self) -> None:
        """Refuse arrays that are no posterior of the parameters.

        Raises:
            InputError: an array that is empty, of the wrong shape, no numbers, NaN or infinite.
        """
        count = len(self.parameters)
        steps = self.draws.shape[:2]
        _check_array('draws', self.draws, (*steps, count), 3)
        _check_array('log_density', self.log_density, steps, 2, infinite=True)
        _check_array('best', self.best, (count,), 1)
        for sketch in filter(np.size, self.sketches):  # a short record has none
            _check_array('sketches', sketch, sketch.shape, 2)

    def carried(self) -> Carried:
        """Return the draws as a prior for later tests of the same actuator."""
        return as_prior(self.names, self.posterior)


def as_prior(names: Sequence[str], draws: Array) -> Carried:
    """Return draws (m, p) of parameters as a prior, normal in logarithms where all are positive.

    Args:
        names: of the columns.
        draws: SI units.
    """
    from actuator_glue.inference.mixture_density import components

    found = Carried.thinned(names, draws)
    positive = (found.draws > 0.0).all(axis=0)
    logs = np.where(positive, np.log(np.where(positive, found.draws, 1.0)), found.draws)
    return replace(found, components=components(logs, _COMPONENTS))


def _check_array(
    name: str, values: Array, shape: tuple[int, ...], axes: int, *, infinite: bool = False
) -> None:
    """Refuse an array of another shape, an empty one, and what holds more than numbers."""
    if values.ndim != axes or values.shape != shape or not values.size:
        raise InputError(
            f'array {name} has the shape {values.shape}, which does not go with the parameters'
        )
    if values.dtype.kind not in 'fiu':
        raise InputError(f'array {name} holds no numbers')
    if np.isnan(values).any() or not (infinite or np.isfinite(values).all()):
        raise InputError(f'array {name} holds {"NaN" if infinite else "NaN or infinite numbers"}')
