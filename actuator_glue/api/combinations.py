"""What a test tells where the specimen's stiffness is not known: Eq. (2)'s own combinations."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Unpack

import numpy as np

from actuator_glue.api import judgement, store
from actuator_glue.api.calibration import Progress, calibrate
from actuator_glue.api.calibration_error import best_residuals
from actuator_glue.api.calibration_options import CalibrationChanges, CalibrationOptions
from actuator_glue.api.calibration_parts import marginals, marginals_frame, marginals_json
from actuator_glue.api.combinations_data import COMBINATIONS, CombinationsData
from actuator_glue.api.given import Records, records_given
from actuator_glue.api.matlab import TransferFunction, delay_of, write_mat
from actuator_glue.api.options import chosen, takes
from actuator_glue.api.result import Result
from actuator_glue.diagnosis.verdict.residual_structure import DIAGNOSE
from actuator_glue.errors import InputError
from actuator_glue.hygiene.checks import pull
from actuator_glue.hygiene.unlike_rest import unlike_rest
from actuator_glue.model.structure import Structure
from actuator_glue.motion import METRES, speaking
from actuator_glue.records import Array, Record, source_names

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame

    from actuator_glue.report import html
    from actuator_glue.report.first_page import FirstPage

# A stiffness that stands for the unknown one [N/m]: whatever that is, some parameters inside the
# box of Table 3 move as the actuator does. Nothing that is reported depends on it.
_STAND_IN = 250e3
_DIAGNOSE = 'with the stiffness, `actuator-glue diagnose` tells what is missing'
COST = (
    'the specimen stiffness is not known: alpha_1_beta_0, alpha_2 and alpha_3 cannot be told apart'
    ' from it. What is told holds for this specimen alone: it predicts no other stiffness, no '
    'force and no hybrid test; a test of the free actuator on its own (--stiffness 0) tells beta_1'
)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Combinations(Result, CombinationsData):
    """What is known of an actuator under a specimen of unknown stiffness.

    Its numbers are those of `CombinationsData`: `combinations` by name, `draws`, `problems`, ...
    """

    schema: ClassVar[str] = 'actuator_glue.combinations/1'

    @property
    def model_effects(self) -> tuple[str, ...]:
        """Effects of the model beyond Eq. (2)."""
        return self.effects

    def to_dataframe(self) -> DataFrame:
        """Return a table of the combinations, a row for each; columns as of a calibration's.

        Raises:
            InputError: pandas is not installed.
        """
        return marginals_frame(self.combinations, self.posterior, self.motion, 'combination')

    def to_json(self) -> dict[str, Any]:
        """Return the object of schema `actuator_glue.combinations/1` (draws left out)."""
        return {
            'schema': self.schema,
            'combinations': marginals_json(self.combinations, self.posterior),
            'error': asdict(self.error),
            'structure': None if self.structure is None else self.structure.to_json(),
            'problems': list(self.problems),
            'notes': list(self.notes),
            'converged': self.converged,
            'effects': list(self.effects),
            'records': [asdict(source) for source in self.sources],
            'motion': self.motion,
            'tracking': [asdict(each) for each in self.tracking],
            'evaluations': self.evaluations,
            'seconds': self.seconds,
        }

    def save(self, path: Path | str) -> Path:
        """Write everything but the records to one .npz file, nothing of it pickled.

        Raises:
            InputError: the file cannot be written.
        """
        kept = replace(self, records=(), residuals=())
        return store.save(path, self.schema, kept, self.effects)

    def save_mat(self, path: Path | str) -> Path:
        """Write draws and model to a .mat file for MATLAB; return its path.

        `draws` (m x p), `names`, `units`, `mean`, `covariance`, and `model`: b / (s^2 + a s + b +
        c) of the one specimen that was tested, as `tf(model.num, model.den)` takes it; its
        `stiffness` is NaN.

        Raises:
            InputError: the file cannot be written.
        """
        units = {name: p.unit for name, p in self.combinations.items()}
        models, effects, problems = [_transfer(self)], self.effects, self.problems
        return write_mat(path, self.posterior, units, models, effects=effects, problems=problems)

    def plot(self) -> Figure:
        """Return a figure of the distribution of each combination, and of each pair."""
        from actuator_glue.api.combinations_report import figure

        with speaking(self.motion):
            return figure(self)

    def brief(self) -> list[html.Block]:
        """Return problems, combinations, error and what they cost."""
        from actuator_glue.api.combinations_report import brief

        return brief(self)

    def first_page(self) -> FirstPage:
        """Return what a person is told first, without a picture."""
        from actuator_glue.api.combinations_report import first_page

        return first_page(self, drawn=False)

    def page(self, next_command: str = '') -> html.Page:
        """Return the report; `next_command` as `report` takes it."""
        from actuator_glue.api.combinations_report import page

        return page(self, next_command)

    def report(self, path: Path | str, next_command: str = '') -> Path:
        """Write a report, one HTML file, and return its path.

        Args:
            path: where to.
            next_command: what the first page says to type next; empty for a command over the
                same files.

        Raises:
            InputError: the file cannot be written.
        """
        from actuator_glue.report import html
        from actuator_glue.report.page_name import page_path

        with speaking(self.motion):
            return html.write(page_path(path), self.page(next_command))


@takes(CalibrationOptions)
def combinations(
    records: Records,
    options: CalibrationOptions | None = None,
    *,
    progress: Progress | bool | None = None,
    **changes: Unpack[CalibrationChanges],
) -> Combinations:
    """Return what records tell under one specimen whose stiffness is not known.

    Args:
        records: one or several tests under the same specimen, or the files they are in; what they
            say of a stiffness is left aside.
        options: how to calibrate; see CalibrationOptions.
        progress: as `calibrate` takes it.
        changes: options by name.

    Raises:
        InputError: as `calibrate`; an earlier calibration or the force as evidence, which need the
            stiffness, as do effects with a force or a mass.

    Example:
        >>> found = combinations('clamped.csv')  # doctest: +SKIP
    """
    options = chosen(CalibrationOptions, options, changes, 'combinations')
    if options.prior is not None or options.use_force:
        raise InputError(
            'an earlier calibration and the force as evidence need the specimen stiffness; give '
            'it in N/m'
        )
    own = Structure(options.effects).parameters[4:]
    needing = [p.name for p in own if 'N' in p.unit or 'kg' in p.unit]
    if needing:
        raise InputError(
            f'{", ".join(needing)} cannot be told from a stiffness that is not known; give it in '
            'N/m, or leave the effect out'
        )
    given = records_given(records)
    stand_in = [replace(r, force=None, motion=METRES, stiffness=_STAND_IN) for r in given]
    found = calibrate(stand_in, options, progress=progress)
    draws = _combined(found.draws)
    rest = list(found.parameters.items())[4:]
    units = COMBINATIONS | {name: p.unit for name, p in rest}
    bounds = [(0.0, math.inf)] * len(COMBINATIONS) + [p.bounds for _, p in rest]
    known = marginals(draws, _combined(found.best), units, bounds)
    told = judgement.remarks(
        found.records,
        found.parameters,
        found.posterior,
        found.converged,
        found.at_bound,
    )
    converged = judgement.converged(known)
    left = found.structure
    unlike = () if left is None else unlike_rest(given, left.noise_m)
    found_pull, told_pull = _pushed(given)
    problems = judgement.problems((), known, found.error, None, found.structure, unlike)
    return Combinations(
        combinations=known,
        draws=draws,
        error=found.error,
        problems=tuple(line.replace(DIAGNOSE, _DIAGNOSE) for line in problems),
        notes=(COST, *told_pull, *(line for line in found.notes if line not in told)),
        converged=converged,
        effects=found.effects,
        sources=tuple(
            replace(s, stiffness_n_per_m=None, motion=r.motion)
            for s, r in zip(found.sources, given, strict=True)
        ),
        tracking=found.tracking,
        evaluations=found.evaluations,
        seconds=found.seconds,
        records=tuple(given),
        structure=found.structure,
        residuals=tuple(best_residuals(found)),
        pull=found_pull,
    )


def _transfer(found: CombinationsData) -> TransferFunction:
    """Return b / (s^2 + a s + b + c) of the mean of the draws, and of each."""
    draws, names = found.posterior, list(found.combinations)
    late = delay_of(names, draws.mean(axis=0))
    b, a, c = draws[:, :3].T
    den = np.column_stack([np.ones_like(b), a, b + c])
    return TransferFunction(
        math.nan, b.mean(keepdims=True), den.mean(axis=0), late, b[:, None], den
    )


def _combined(draws: Array) -> Array:
    """Return the combinations of draws (..., p)."""
    beta_1, loop, oil, leak = np.moveaxis(draws[..., :4], -1, 0)
    total = oil + _STAND_IN
    share = leak * _STAND_IN / total
    made = np.stack([loop / total, beta_1 + share, beta_1 * share], axis=-1)
    return np.concatenate([made, draws[..., 4:]], axis=-1)


def _pushed(records: list[Record]) -> tuple[float | None, list[str]]:
    """Return the stiffness that the recorded forces suggest [N/m], and that in words."""
    seen, told = [], []
    called = source_names(record.source for record in records)
    for number, record in enumerate(records, start=1):
        found = pull(record)
        if found is not None and record.motion == METRES:
            seen.append(abs(found))
            name = called[record.source] or f'record {number}'
            told.append(
                f'{name}: force over displacement is {abs(found):.3g} N/m; --stiffness '
                f'{abs(found):.3g} would tell all that two tests can'
            )
    return float(np.median(seen)) if seen else None, told
