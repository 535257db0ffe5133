"""What a test tells where the specimen's stiffness is not known: Eq. (2)'s own combinations."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any, ClassVar, Unpack

import numpy as np

from actuator_glue.api import judgement, tracking
from actuator_glue.api.calibration import calibrate
from actuator_glue.api.calibration_options import CalibrationChanges, CalibrationOptions
from actuator_glue.api.calibration_parts import CalibratedRecord, FitError, Marginal
from actuator_glue.api.given import Records, records_given
from actuator_glue.api.options import chosen, takes
from actuator_glue.api.result import Result
from actuator_glue.api.tracking import RecordTracking
from actuator_glue.errors import InputError
from actuator_glue.hygiene.checks import pull
from actuator_glue.inference.moments import moments
from actuator_glue.model.structure import Structure
from actuator_glue.motion import METRES, speaking
from actuator_glue.records import Array, Record, source_name

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from actuator_glue.report import html

# A stiffness that stands for the one nobody knows [N/m]: whatever that is, some parameters inside
# the box of Table 3 move as the actuator does. Nothing that is told depends on it.
_STAND_IN = 250e3
# Of the transfer function of Eq. (2), b / (s^2 + a s + b + c), in the order of the draws.
NAMES = {
    'alpha_1_beta_0 / (alpha_2 + k)': '1/s^2',
    'beta_1 + alpha_3 k / (alpha_2 + k)': '1/s',
    'beta_1 alpha_3 k / (alpha_2 + k)': '1/s^2',
}
COST = (
    'the specimen stiffness is not known: alpha_1_beta_0, alpha_2 and alpha_3 cannot be told apart'
    ' from it. What is told holds for this specimen alone: it predicts no other stiffness, no '
    'force and no hybrid test; a test of the free actuator on its own (--stiffness 0) tells beta_1'
)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Combinations(Result):
    """What is known of an actuator under a specimen of a stiffness that is not.

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
    """

    schema: ClassVar[str] = 'actuator_glue.combinations/1'

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

    @property
    def model_effects(self) -> tuple[str, ...]:
        """Effects of the model beyond Eq. (2)."""
        return self.effects

    @property
    def posterior(self) -> Array:
        """All draws, shape (m, p)."""
        return self.draws.reshape(-1, self.draws.shape[-1])

    def to_json(self) -> dict[str, Any]:
        """Return the object of schema `actuator_glue.combinations/1` (draws left out)."""
        return {
            'schema': self.schema,
            'combinations': {name: asdict(p) for name, p in self.combinations.items()},
            'error': asdict(self.error),
            'problems': list(self.problems),
            'notes': list(self.notes),
            'converged': self.converged,
            'effects': list(self.effects),
            'records': [asdict(source) for source in self.sources],
            'tracking': [asdict(each) for each in self.tracking],
            'evaluations': self.evaluations,
            'seconds': self.seconds,
        }

    def plot(self) -> Figure:
        """Return a figure of the distribution of each combination, and of each pair."""
        from actuator_glue.report.posterior_figure import posterior_figure

        units = [p.unit for p in self.combinations.values()]
        with speaking(self.motion):
            return posterior_figure(self.posterior, ('b', 'a', 'c', *self._rest()), units)

    def _rest(self) -> list[str]:
        return list(self.combinations)[len(NAMES) :]

    def rows(self) -> list[tuple[str, ...]]:
        """Return a row of text for each combination: name, unit, mean, sd, R-hat."""
        return [
            (name, p.unit, f'{p.mean:.5g}', f'{p.stddev:.3g}', f'{p.rhat:.4f}')
            for name, p in self.combinations.items()
        ]

    def error_line(self) -> str:
        """Return the error of the best draw in a line."""
        share = self.error.nrmse
        spread = '' if share is None else f', {100.0 * share:.2f} % of the spread measured'
        return f'error of the best draw: {1e3 * self.error.rms_m:.4g} mm rms{spread}'

    def brief(self) -> list[html.Block]:
        """Return problems, combinations, error and what they cost."""
        from actuator_glue.report import html

        return [
            *(html.Note(line) for line in self.problems),
            html.Table(HEADER, self.rows(), TITLE),
            html.Text(self.error_line()),
            *tracking.tables(self.tracking),
            *(html.Note(line) for line in self.notes),
        ]

    def page(self) -> html.Page:
        """Return the report."""
        from actuator_glue.report import html

        picture = html.Picture.of(
            self.plot(), 'Distribution of each combination; b, a, c as above.'
        )
        sections = [
            html.Section('The answer', self.brief()),
            html.Section('Posterior', [picture]),
        ]
        made = f'{self.evaluations} evaluations'
        return html.Page('Calibration without a stiffness', self.notes[0], sections, made)


HEADER = ('combination', 'unit', 'mean', 'sd', 'R-hat')
TITLE = 'b, a and c of x/u = b / (s^2 + a s + b + c), Eq. (2), and effects'


@takes(CalibrationOptions)
def combinations(
    records: Records,
    options: CalibrationOptions | None = None,
    *,
    progress: Callable[[float], None] | None = None,
    **changes: Unpack[CalibrationChanges],
) -> Combinations:
    """Return what records tell under one specimen whose stiffness is not known.

    Args:
        records: one or several tests under the same specimen, or the files they are in; what they
            say of a stiffness is left aside.
        options: how to calibrate; see CalibrationOptions.
        progress: called with the evaluations made so far.
        changes: options by name.

    Raises:
        InputError: as `calibrate`; an earlier calibration or the force as evidence, which need the
            stiffness, as do effects with a force or a mass.

    Example:
        >>> found = combinations('clamped.csv')  # doctest: +SKIP
    """
    options = chosen(options or CalibrationOptions(), changes, 'combinations')
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
    known = _marginals(draws, _combined(found.best), found, [p.unit for p in own])
    told = judgement.remarks(
        found.records,
        found.parameters,
        found.posterior,
        found.converged,
        found.at_bound,
    )
    converged = judgement.converged(known)
    return Combinations(
        combinations=known,
        draws=draws,
        error=found.error,
        problems=tuple(judgement.problems((), known, found.error, None, found.structure)),
        notes=(COST, *_pushed(given), *(line for line in found.notes if line not in told)),
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
    )


def _combined(draws: Array) -> Array:
    """Return the combinations of draws (..., p)."""
    beta_1, loop, oil, leak = np.moveaxis(draws[..., :4], -1, 0)
    total = oil + _STAND_IN
    share = leak * _STAND_IN / total
    made = np.stack([loop / total, beta_1 + share, beta_1 * share], axis=-1)
    return np.concatenate([made, draws[..., 4:]], axis=-1)


def _marginals(draws: Array, best: Array, found: Any, units: list[str]) -> dict[str, Marginal]:
    import arviz as az

    flat = draws.reshape(-1, draws.shape[-1])
    bounds = [(0.0, float('inf'))] * len(NAMES)
    bounds += [p.bounds for p in list(found.parameters.values())[4:]]
    names = [*NAMES, *list(found.parameters)[4:]]
    found_moments = moments(flat, flat.min(axis=0), flat.max(axis=0))
    data = az.convert_to_dataset({'theta': np.swapaxes(draws, 0, 1)})
    rhat, ess = az.rhat(data)['theta'].values, az.ess(data)['theta'].values
    return {
        name: Marginal(
            mean=float(found_moments.mean[i]),
            stddev=float(found_moments.stddev[i]),
            skewness=float(found_moments.skewness[i]),
            cov=float(found_moments.cov[i]),
            rhat=float(rhat[i]),
            ess=float(ess[i]),
            best=float(best[i]),
            unit=unit,
            bounds=bounds[i],
            prior_dominated=False,
        )
        for i, (name, unit) in enumerate(zip(names, [*NAMES.values(), *units], strict=True))
    }


def _pushed(records: list[Record]) -> list[str]:
    """Return what the recorded forces say of the stiffness."""
    told = []
    for number, record in enumerate(records, start=1):
        found = pull(record)
        if found is not None and record.motion == METRES:
            name = source_name(record.source) or f'record {number}'
            told.append(
                f'{name}: force over displacement is {abs(found):.3g} N/m; --stiffness '
                f'{abs(found):.3g} would tell all that two tests can'
            )
    return told
