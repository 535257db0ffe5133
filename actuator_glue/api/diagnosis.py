"""Diagnosis: is the model enough for given records, and if not, what does it lack."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, fields, replace
from datetime import timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, TypedDict, Unpack

import numpy as np
from threadpoolctl import threadpool_limits

from actuator_glue.api import store
from actuator_glue.api.bar import shown
from actuator_glue.api.callbacks import harmless
from actuator_glue.api.doubt import doubts
from actuator_glue.api.drawn import Drawn
from actuator_glue.api.ensemble import residual_of
from actuator_glue.api.frame import frame
from actuator_glue.api.given import Records, Stiffness, records_given, seed_given
from actuator_glue.api.held_out_stiffness import with_stiffness
from actuator_glue.api.options import chosen, takes
from actuator_glue.api.posterior_model import PosteriorModel
from actuator_glue.api.prior import DRIFT, check_prior, given_prior
from actuator_glue.api.provenance import provenance
from actuator_glue.api.tracking import RecordTracking, ready, records_tracking, tables
from actuator_glue.diagnosis import diagnose as core
from actuator_glue.diagnosis.estimate import Estimate, Json
from actuator_glue.diagnosis.remembered import Before, Remembered
from actuator_glue.diagnosis.telling.result import SCHEMA, DiagnosisData
from actuator_glue.diagnosis.thresholds import Thresholds
from actuator_glue.diagnosis.verdict.first_look import FirstLook
from actuator_glue.effects import save_effects
from actuator_glue.errors import InputError
from actuator_glue.given import take_numbers
from actuator_glue.hygiene.clean import initial_state
from actuator_glue.hygiene.repeats import refuse_known
from actuator_glue.hygiene.suspicions import suspicions
from actuator_glue.inference.least_squares import decimate
from actuator_glue.inference.predictive import ResidualModel
from actuator_glue.model.effects import CATALOGUE
from actuator_glue.motion import METRES, speaking, spoken
from actuator_glue.records import Record

if TYPE_CHECKING:
    import arviz
    from matplotlib.figure import Figure
    from pandas import DataFrame

    from actuator_glue.api.calibration_result import Calibration
    from actuator_glue.hybrid.partition import Partition
    from actuator_glue.inference.prior_use import GivenPrior
    from actuator_glue.report import html
    from actuator_glue.report.first_page import FirstPage

Progress = Callable[[str, float], None]


@dataclass(frozen=True, slots=True, repr=False)
class Diagnosis(PosteriorModel, DiagnosisData):
    """Verdict, evidence and the augmented model, with its files and pictures.

    Attributes:
        tracking: how the augmented model follows the command of each fitted record.
        motion: what the records measure: 'm', or 'deg', 'counts' and so on, see `Record`.
        records, held: the records it was asked about, and those given as `holdout`, as they were
            given; empty after `load`.
        fine: root of the variance that single samples have beyond the means that were fitted [m];
            0 where samples were.
    """

    schema: ClassVar[str] = SCHEMA
    tracking: tuple[RecordTracking, ...] = ()
    motion: str = METRES
    records: tuple[Record, ...] = ()
    held: tuple[Record, ...] = ()
    fine: float = 0.0

    def summary(self) -> str:
        """Return the first line for people: the verdict, and the error before and after."""
        return spoken(DiagnosisData.summary(self), self.motion)

    def to_json(self) -> Json:
        """Return the object of schema `actuator_glue.diagnosis/1` (curves and draws left out)."""
        own = CATALOGUE.definitions(self.structure).get('definitions', {})
        own |= {term.name: term.definition for term in self.learned}
        return {
            **DiagnosisData.to_json(self),
            'tracking': [asdict(of) for of in self.tracking],
            'motion': self.motion,
            **({'definitions': own} if own else {}),
        }

    def to_dataframe(self) -> DataFrame:
        """Return a table of the sizes, a row for each parameter by its name.

        Columns: `effect` (empty for Eq. (2)'s own), `probability` of that effect (NaN for a
        learned term), `alternatives` that these records cannot tell from it, `unit`, `mean`,
        `stddev`, `lower` and `upper` (95 % interval), `identified`, and of Eq. (2)'s parameters
        `before`: the mean without any addition. SI units, or what `unit` says where the records
        move in degrees, counts or volts.

        Raises:
            InputError: pandas is not installed.
        """
        rows: list[dict[str, Any]] = [
            _row('', n, p) | {'before': _mean(self.base_before, n)} for n, p in self.base.items()
        ]
        for effect in self.effects:
            rows += [
                _row(effect.name, name, p)
                | {
                    'probability': effect.probability,
                    'alternatives': ', '.join(effect.alternatives),
                }
                for name, p in effect.parameters.items()
            ]
        for row in rows:
            row['unit'] = spoken(row['unit'], self.motion)
        return frame(rows, 'parameter')

    def save(self, path: Path | str) -> Path:
        """Write everything but the records to one .npz file, nothing of it pickled.

        Raises:
            InputError: the file cannot be written.
        """
        kept = replace(self, records=(), held=())
        return store.save(path, self.schema, kept, self.model_effects)

    def save_effects(self, path: Path | str) -> Path:
        """Write the learned terms as a file of effects and return its path.

        `load_effects`, `--effects-file` and the nodes' parameter `effects_file` read it.

        Raises:
            InputError: no term was learned, or the file cannot be written.
        """
        if not self.learned:
            raise InputError(f'{path}: no term was learned, there is nothing to write')
        save_effects(path, (term.effect for term in self.learned))
        return Path(path)

    @property
    def model_effects(self) -> tuple[str, ...]:
        """Effects of the augmented model."""
        return self.structure

    def drawn(self) -> Drawn:
        """Return the draws under the structure that is told, for predictions.

        Raises:
            InputError: a record has settings of its own, which no other test has.
        """
        if set(self.names) != set(self.model.names) or not len(self.joint):
            raise InputError(
                'a record has settings of its own in this model, so that it tells nothing of '
                'other tests: diagnose the records apart'
            )
        known = self._sizes()
        left = self._left()
        if left is not None:
            left = replace(left, sd=math.hypot(left.sd, self.fine))
        return Drawn(
            self.joint,
            self.names,
            tuple(known[n].unit if n in known else '' for n in self.names),
            self.best,
            self.model,
            left,
            (),
            tuple(dict.fromkeys(t.stiffness for t in self.traces)),
            () if self.complete else (self.summary(),),
        )

    def _sizes(self) -> dict[str, Estimate]:
        """Return every parameter that is told: Eq. (2)'s and the effects'."""
        known = dict(self.base)
        for effect in self.effects:
            known |= effect.parameters
        return known

    def _left(self) -> ResidualModel | None:
        """Return what the model left of the held-out data, as these were fitted: of means."""
        left = [
            (t.measured - t.after)[part]
            for t in self.traces
            if t.held_out
            for part in t.stretches()
        ]
        return residual_of(left, len(self.names))

    @property
    def inference_data(self) -> arviz.InferenceData:
        """Draws of the augmented model for arviz, one chain.

        `posterior`: bounds, units and what drew them are attributes. Draws of importance sampling
        are independent but for those that are equal: `effective_draws` says what they are worth.
        `observed_data` and `constant_data`: of each part of a record, fitted or held out, the
        displacement; its time, command, stiffness, and the simulations before and after.
        Where the records are known, that is not after `load`, of some 200 draws under the
        structure that is told, whose parameters are coordinates (intervals that are told average
        over other structures, too): `posterior_predictive` (simulated measurements) and
        `log_likelihood`, the density of the displacement with an AR(1) residual as the held-out
        part shows it, in terms of a second each. Both are left out where the simulation
        cannot be made again: of models with settings of single records, and of what appeared in
        the middle of a record.
        """
        import arviz as az

        from actuator_glue.api.diagnosis_groups import observed, predicted

        draws = {n: self.posterior[None, :, i] for i, n in enumerate(self.names)}
        data = az.from_dict(posterior=draws)
        groups = observed(self.traces)
        if self.records and set(self.names) == set(self.model.names):
            of_means = replace(self.drawn(), residual=self._left())
            groups |= predicted(self, of_means, self.records, self.held)
        data.add_groups(groups)
        data.posterior.attrs.update({k: v for k, v in self.sampler.items() if v is not None})
        for name, estimate in self._sizes().items():
            if name in draws:
                data.posterior[name].attrs['unit'] = estimate.unit
                if estimate.bounds:
                    data.posterior[name].attrs['lower'] = estimate.bounds[0]
                    data.posterior[name].attrs['upper'] = estimate.bounds[1]
        return data

    def plot(self) -> Figure:
        """Return a figure of the predictive bands before and after, where they differ most."""
        from actuator_glue.report.diagnosis_figures import bands

        with speaking(self.motion):
            return bands(self)

    def brief(self) -> list[html.Block]:
        """Return verdict, effects and advice."""
        from actuator_glue.report.diagnosis_report import brief

        return brief(self)

    def first_page(self, partition: Partition | Path | str | None = None) -> FirstPage:
        """Return what a person is told first; see `PosteriorModel`."""
        from actuator_glue.report.diagnosis_summary import first_page

        return first_page(self, self.hybrid(partition), drawn=False)

    def page(
        self, partition: Partition | Path | str | None = None, next_command: str = ''
    ) -> html.Page:
        """Return the report.

        Args:
            partition: as `first_page` takes it.
            next_command: as `report` takes it.
        """
        from actuator_glue.report.diagnosis_report import page

        return page(self, tables(self.tracking), self.hybrid(partition), next_command)


def _row(effect: str, name: str, size: Estimate) -> dict[str, Any]:
    """Return the columns of one size that every one has."""
    return {
        'parameter': name,
        'effect': effect,
        'probability': math.nan,
        'alternatives': '',
        'unit': size.unit,
        'mean': size.mean,
        'stddev': size.stddev,
        'lower': size.lower,
        'upper': size.upper,
        'identified': size.identified,
        'before': math.nan,
    }


def _mean(sizes: Mapping[str, Estimate], name: str) -> float:
    return sizes[name].mean if name in sizes else math.nan


@dataclass(frozen=True, slots=True)
class DiagnosisOptions:
    """How to diagnose; every one has the default of the command line.

    Attributes:
        seed: seed of every random step; the same seed gives the same diagnosis. None for a fresh
            one, which the result's provenance says.
        jobs: threads for the refits of candidates; the result does not depend on it.
        false_alarms: probability of an addition on a healthy machine.
        prior: an earlier calibration of the actuator, or the file it was saved to: what it knew
            of Eq. (2)'s parameters goes into fits and posterior; or what is known by now, with
            its drift and age. None for nothing.
        drift: standard deviation by which the logarithm of each parameter may have moved in an
            hour since (random walk) [h^-1/2].
        prior_age: time since that calibration, a `timedelta` or a number of seconds.
        use_force: the recorded force chooses among names that the displacement leaves tied.
        effort: how much is simulated before what is known by then is told, in times of the usual,
            which is about a minute on two cores.
    """

    seed: int = 1
    jobs: int = 2
    false_alarms: float = 0.01
    prior: Calibration | GivenPrior | Path | str | None = None
    drift: float = DRIFT
    prior_age: timedelta | float = 0.0
    use_force: bool = False
    effort: float = 1.0

    def __post_init__(self) -> None:
        object.__setattr__(self, 'seed', seed_given(self.seed))
        take_numbers(self)
        check_prior(self.prior is not None, self.drift, self.prior_age)
        if self.jobs < 1:
            raise InputError(f'jobs {self.jobs} is below 1')
        if not self.effort > 0.0:
            raise InputError(f'effort {self.effort:g} is not above 0')
        if not 0.0 < self.false_alarms < 1.0:
            raise InputError(
                f'false_alarms {self.false_alarms:g} is no probability between 0 and 1'
            )


class DiagnosisChanges(TypedDict, total=False):
    """The options by name, for type checkers; a test holds them to `DiagnosisOptions`."""

    seed: int | None
    jobs: int
    false_alarms: float
    prior: Calibration | GivenPrior | Path | str | None
    drift: float
    prior_age: timedelta | float
    use_force: bool
    effort: float


@takes(DiagnosisOptions)
def diagnose(
    records: Records,
    holdout: Records | None = None,
    options: DiagnosisOptions | None = None,
    *,
    stiffness: Stiffness = None,
    progress: Progress | bool | None = None,
    first_look: Callable[[FirstLook], None] | None = None,
    remembered: Remembered | None = None,
    **changes: Unpack[DiagnosisChanges],
) -> Diagnosis:
    """Ask whether Eq. (2) explains records and, if not, which effects it lacks.

    Args:
        records: one or several tests of one actuator, each with its specimen stiffness, or the
            files they are in; several go into one list.
        holdout: record(s) that decide nothing and give the error before and after; without one,
            every fourth block of each record is set aside before any look. One that does not say
            its stiffness has the one that all records share.
        options: those below as one object; None for their defaults.
        stiffness: specimen stiffness [N/m] of the records, one for all or one for each; None for
            what they and their files say.
        progress: called with (stage, share of the whole that is done, in [0, 1]); True for a bar,
            False for none; None for a bar in a notebook.
        first_look: called once, seconds after the start, with what Eq. (2) leaves.
        remembered: what looking at fewer records of the same machine left, for a quicker answer;
            receives what this call leaves.
        changes: options by name.

    Returns:
        Verdict, additions with their evidence, error before and after, the augmented model.

    Raises:
        InputError: stiffness not known, records too short, channels that cannot belong together,
            or an option that cannot be used.
    """
    options = chosen(DiagnosisOptions, options, changes, 'diagnose')
    started = time.perf_counter()
    given = records_given(records, stiffness)
    held = [] if holdout is None else records_given(holdout, name='holdout')
    if held and held[0].motion != given[0].motion:
        raise InputError(
            f'holdout: moves in {held[0].motion}, and the records move in {given[0].motion}'
        )
    held, assumed = with_stiffness(held, given)
    every = [*given, *held]
    before = given_prior(options.prior, options.drift, options.prior_age)
    if before is not None:
        refuse_known(every, before.sketches, before.source)
    with (
        # Our matrices are small and our own threads use the cores: those of the linear algebra on
        # top would only wait for each other (1.5 times the time, twice that of the processor).
        threadpool_limits(limits=1, user_api='blas'),
        shown('diagnose', 1.0, False if callable(progress) else progress) as bar,
        ThreadPoolExecutor(options.jobs) as pool,
    ):
        found = core.diagnose(
            given,
            held,
            seed=options.seed,
            each=pool.map,
            progress=harmless(progress) if callable(progress) else lambda stage, share: bar(share),
            first_look=None if first_look is None else harmless(first_look),
            settings=Thresholds(
                false_alarms=options.false_alarms,
                use_force=options.use_force,
                effort=options.effort * Thresholds().effort,
            ),
            before=Before(before, remembered),
        )
    values = {f.name: getattr(found, f.name) for f in fields(found)}
    told = doubts(found, every) if found.complete else suspicions(every)
    values['advice'] = (*told, *assumed, *found.advice)
    values['doubts'] = told if found.complete else ()
    values['seconds'] = time.perf_counter() - started
    values['provenance'] = provenance(every, options.seed)
    known = _fitted(found, given)
    return Diagnosis(
        **values,
        tracking=_tracking(found, known, every),
        fine=_fine(found, known),
        motion=given[0].motion,
        records=tuple(given),
        held=tuple(held),
    )


def _fitted(found: DiagnosisData, records: Sequence[Record]) -> list[Record]:
    """Return the samples of each fitted record, under the set-up that was taken.

    None where one has its own settings; none of records that were left out.
    """
    if set(found.names) != set(found.model.names):
        return []
    fitted = {of['source'] for of in found.sampling}
    cleaned = ready(records)
    if found.setup is not None and found.setup.taken:
        taken = found.setup
        rows = zip(taken.sources, taken.stiffness, taken.hold, strict=True)
        under = {source: (k, hold) for source, k, hold in rows}
        cleaned = [
            replace(r, stiffness=under[r.source][0], hold=under[r.source][1])
            if r.source in under
            else r
            for r in cleaned
        ]
    return [r for r in cleaned if r.source in fitted]


def _tracking(
    found: DiagnosisData, fitted: Sequence[Record], every: Sequence[Record]
) -> tuple[RecordTracking, ...]:
    """Return how the augmented model follows each fitted record, named among all records."""
    if not fitted:
        return ()
    return records_tracking(found.joint, found.names, found.model, fitted, every)


def _fine(found: DiagnosisData, fitted: Sequence[Record]) -> float:
    """Return by how much single samples scatter beyond means, see `Diagnosis`.

    What a wrong initial state or something that appeared in the middle of a record leaves is slow,
    and in samples and means alike.
    """
    total, samples = 0.0, 0
    rows = {of['source']: of for of in found.sampling}
    for record in fitted:
        of = rows[record.source]
        count = round(of['rate_hz'] / of['fitted_rate_hz'])
        moved = found.model.simulate(found.best, record, initial=initial_state(record))
        error = np.ravel(record.measured - moved)
        beyond = error.var() - decimate.means(error, count).var() if count > 1 else 0.0
        if np.isfinite(beyond):
            total += max(float(beyond), 0.0) * len(record)
            samples += len(record)
    return math.sqrt(total / max(samples, 1))
