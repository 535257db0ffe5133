"""The result of a calibration: what is known of each parameter, with its files and pictures."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from actuator_glue.api import store
from actuator_glue.api.calibration_data import CalibrationData
from actuator_glue.api.calibration_parts import marginals_frame, marginals_json
from actuator_glue.api.drawn import Drawn
from actuator_glue.api.given import OneRecord, one_record_given
from actuator_glue.api.posterior_model import PosteriorModel
from actuator_glue.errors import InputError
from actuator_glue.model.effects import CATALOGUE
from actuator_glue.model.structure import Structure
from actuator_glue.motion import speaking

if TYPE_CHECKING:
    import arviz
    from matplotlib.figure import Figure
    from pandas import DataFrame

    from actuator_glue.hybrid.partition import Partition
    from actuator_glue.report import html
    from actuator_glue.report.first_page import FirstPage


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Calibration(PosteriorModel, CalibrationData):
    """A joint posterior, and what forbids or limits its use.

    Its numbers are those of `CalibrationData`: `parameters` by name, `draws`, `problems`, ...
    """

    schema: ClassVar[str] = 'actuator_glue.calibration/1'

    @property
    def model_effects(self) -> tuple[str, ...]:
        """Effects of the model beyond Eq. (2)."""
        return self.effects

    def drawn(self) -> Drawn:
        """Return the draws and their model, for predictions."""
        stiffness = dict.fromkeys(
            r.stiffness_n_per_m for r in self.sources if r.stiffness_n_per_m is not None
        )
        return Drawn(
            self.posterior,
            self.names,
            tuple(p.unit for p in self.parameters.values()),
            self.best,
            Structure(self.effects),
            self.residual,
            self.records,
            tuple(stiffness),
            self.problems,
        )

    @property
    def inference_data(self) -> arviz.InferenceData:
        """The draws for arviz, with what they say of the records.

        `posterior`: every draw, bounds and units as attributes. `sample_stats`: log likelihood.
        Where the records are known, that is not after `load`, of some 200 draws and 2000 samples
        of each record: `posterior_predictive` (simulated measurements), `observed_data`,
        `constant_data` (command, stiffness) and `log_likelihood`, whose terms are seconds of the
        records: neighbouring samples are correlated. They add up to the log likelihood of a draw
        up to a constant.
        """
        from actuator_glue.api.inference_groups import groups

        return groups(self)

    def to_dataframe(self) -> DataFrame:
        """Return a table of the parameters, a row for each by its name.

        Columns: `unit`, `mean`, `stddev`, `lower` and `upper` (95 % interval), `best`,
        `skewness`, `cov`, `rhat`, `ess`, `prior_lower`, `prior_upper`, `prior_dominated`. SI
        units, or what `unit` says where the records move in degrees, counts or volts.

        Raises:
            InputError: pandas is not installed.
        """
        return marginals_frame(self.parameters, self.posterior, self.motion, 'parameter')

    def to_json(self) -> dict[str, Any]:
        """Return the object of schema `actuator_glue.calibration/1` (draws left out)."""
        return {
            'schema': self.schema,
            'parameters': marginals_json(self.parameters, self.posterior),
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
            'motion': self.motion,
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

    @classmethod
    def load(cls, path: Path | str) -> Self:
        """Return what `save` wrote.

        Raises:
            InputError: the file cannot be read, holds something else, or arrays that are no
                posterior: of another shape than its parameters, empty, NaN.
        """
        found = super(Calibration, cls).load(path)
        try:
            found.check()
        except InputError as error:
            raise InputError(
                f'{path}: {error}; the file is damaged or was written by something else: '
                'calibrate again, and save'
            ) from None
        return found

    def plot(self) -> Figure:
        """Return a figure of every parameter's distribution and every pair of them."""
        from actuator_glue.api.calibration_report import posterior

        with speaking(self.motion):
            return posterior(self)

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

    def first_page(self, partition: Partition | Path | str | None = None) -> FirstPage:
        """Return what a person is told first; see `PosteriorModel`."""
        from actuator_glue.api.calibration_report import first_page

        return first_page(self, self.hybrid(partition), drawn=False)

    def page(
        self, partition: Partition | Path | str | None = None, next_command: str = ''
    ) -> html.Page:
        """Return the report: the answer, the posterior, and its bands over the records.

        Args:
            partition: as `first_page` takes it.
            next_command: as `report` takes it.
        """
        from actuator_glue.api.calibration_report import page

        return page(self, self.hybrid(partition), next_command)
