"""The result of a calibration: what is known of each parameter, the draws, files and pictures."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from actuator_glue.api import store
from actuator_glue.api.calibration_parts import CalibratedRecord, FitError, Marginal, RecordForce
from actuator_glue.api.given import OneRecord, one_record_given
from actuator_glue.api.result import Result
from actuator_glue.api.tracking import RecordTracking
from actuator_glue.diagnosis.residual_structure import ResidualStructure
from actuator_glue.inference.at_bound import Pressed
from actuator_glue.inference.carried import Carried
from actuator_glue.inference.prior_use import PriorUse
from actuator_glue.model.effects import CATALOGUE
from actuator_glue.records import Array, Record

if TYPE_CHECKING:
    import arviz
    import control
    from matplotlib.figure import Figure

    from actuator_glue.report import html

# Normal components of the prior that a calibration makes, at most.
COMPONENTS = 4


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Calibration(Result):
    """A joint posterior, and what forbids or limits its use.

    Attributes:
        parameters: posterior of each parameter by name.
        draws: draws after burn-in, shape (steps, chains, p), SI units.
        log_density: log likelihood of each draw, shape (steps, chains).
        best: draw of the highest likelihood, shape (p,).
        error: free-run error of the best draw.
        structure: what is left of the records beside noise; None where they are too short to tell,
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
    """

    schema: ClassVar[str] = 'actuator_glue.calibration/1'

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
    initial: str
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

    @property
    def model_effects(self) -> tuple[str, ...]:
        """Effects of the model beyond Eq. (2)."""
        return self.effects

    @property
    def names(self) -> tuple[str, ...]:
        """Parameters in the order of the draws' columns."""
        return tuple(self.parameters)

    @property
    def posterior(self) -> Array:
        """Draws of all chains, shape (m, p), SI units."""
        return self.draws.reshape(-1, self.draws.shape[2])

    def carried(self) -> Carried:
        """Return the draws as a prior for later tests of the same actuator."""
        from actuator_glue.inference.mixture_density import components

        found = Carried.thinned(self.names, self.posterior)
        positive = (found.draws > 0.0).all(axis=0)
        logs = np.where(positive, np.log(np.where(positive, found.draws, 1.0)), found.draws)
        return replace(found, components=components(logs, COMPONENTS))

    @property
    def inference_data(self) -> arviz.InferenceData:
        """The draws for arviz: posterior, log likelihood, bounds and units as attributes."""
        import arviz as az

        data = az.from_dict(
            posterior={n: self.draws[:, :, i].T for i, n in enumerate(self.names)},
            sample_stats={'lp': self.log_density.T},
        )
        for name, marginal in self.parameters.items():
            data.posterior[name].attrs |= {
                'unit': marginal.unit,
                'prior': 'uniform',
                'lower': marginal.bounds[0],
                'upper': marginal.bounds[1],
            }
        data.posterior.attrs |= {'likelihood': self.likelihood, 'effects': list(self.effects)}
        return data

    def to_json(self) -> dict[str, Any]:
        """Return the object of schema `actuator_glue.calibration/1` (draws left out)."""
        return {
            'schema': self.schema,
            'parameters': {n: asdict(p) for n, p in self.parameters.items()},
            'evaluations': self.evaluations,
            'seconds': self.seconds,
            'compile_seconds': self.compile_seconds,
            'error': asdict(self.error),
            'structure': None if self.structure is None else self.structure.to_json(),
            'problems': list(self.problems),
            'at_bound': [p.to_json() for p in self.at_bound],
            'notes': list(self.notes),
            'converged': self.converged,
            'prior': None if self.prior is None else asdict(self.prior),
            'effects': list(self.effects),
            **CATALOGUE.definitions(self.effects),
            'likelihood': self.likelihood,
            'shaping_factor': self.shaping_factor,
            'automatic_shaping': self.automatic_shaping,
            'use_force': bool(self.force),
            'force': [asdict(f) for f in self.force],
            'seed': self.seed,
            'sampler': self.sampler,
            'initial': self.initial,
            'settle_s': self.settle,
            'records': [asdict(s) for s in self.sources],
            'tracking': [asdict(t) for t in self.tracking],
        }

    def save(self, path: Path | str) -> Path:
        """Write draws, bounds, units and provenance to one .npz file; return its path.

        Arrays for other readers: `draws` (m, p), `names` (p,), `units` (p,).

        Raises:
            InputError: the file cannot be written.
        """
        return store.save(
            path,
            self.schema,
            replace(self, records=()),
            self.effects,
            draws=self.posterior,
            names=np.array(self.names),
            units=np.array([p.unit for p in self.parameters.values()]),
        )

    def state_space(self, stiffness: float, draw: str | int = 'mean') -> control.StateSpace:
        """Return x/u as a `control.StateSpace`; see `transfer_function`."""
        from actuator_glue.api.transfer import state_space

        return state_space(self, stiffness, draw)

    def transfer_function(
        self, stiffness: float, draw: str | int = 'mean'
    ) -> control.TransferFunction:
        """Return the closed-loop actuator x/u, Eq. (2a), as a `control.TransferFunction`.

        Args:
            stiffness: specimen stiffness k [N/m].
            draw: 'mean' of the parameters, 'best' draw, or the number of one in `posterior`.

        Raises:
            InputError: no such draw, or effects that are no rational transfer function.
        """
        import control

        return control.ss2tf(self.state_space(stiffness, draw))

    def plot(self) -> Figure:
        """Return a figure of every parameter's distribution and every pair of them."""
        from actuator_glue.report.posterior_figure import posterior_figure

        units = [p.unit for p in self.parameters.values()]
        return posterior_figure(self.posterior, self.names, units)

    def plot_bands(self, record: OneRecord) -> Figure:
        """Return a figure of the parameter band and the total predictive band over a record.

        Raises:
            InputError: the record's stiffness is not known, or a file that holds several.
        """
        from actuator_glue.api.calibration_report import bands_figure

        return bands_figure(self, one_record_given(record))[0]

    def brief(self) -> list[html.Block]:
        """Return problems, moments, error and notes."""
        from actuator_glue.api.calibration_report import brief

        return brief(self)

    def page(self) -> html.Page:
        """Return the report: the posterior, and its bands over the records."""
        from actuator_glue.api.calibration_report import page

        return page(self)
