"""The posterior of an answer: draws over all plausible structures.

The draws are of the reported structure, of structures with a tied effect in place of a reported
one, and of those with companions too small to report; each draw knows its structure. What is
reported, saved, plotted and exported are these draws.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from actuator_glue.diagnosis.estimate import Estimate
from actuator_glue.diagnosis.learned.term import any_learned
from actuator_glue.diagnosis.posterior import discrepancy, model_form, posterior, ridge
from actuator_glue.diagnosis.posterior.mixed_draws import MixedDraws, mixed
from actuator_glue.diagnosis.posterior.posterior import Draws
from actuator_glue.diagnosis.search import companions
from actuator_glue.diagnosis.search.conclusion import Conclusion
from actuator_glue.diagnosis.search.ties import tied_structures
from actuator_glue.diagnosis.stages import Progress, Stage
from actuator_glue.diagnosis.trial import Trial
from actuator_glue.diagnosis.verdicts import COMPLETE
from actuator_glue.inference.at_bound import Pressed, pressed
from actuator_glue.inference.least_squares.each import Each
from actuator_glue.inference.least_squares.free_run import Model
from actuator_glue.inference.least_squares.space import Space
from actuator_glue.model.parameters import BASE
from actuator_glue.records import Array


@dataclass(frozen=True)
class Side:
    """A refitted structure: its model, best parameters (p,) and posterior draws (m, p)."""

    model: Model
    theta: Array
    draws: Array


@dataclass(frozen=True)
class AnswerPosterior:
    """Draws of Eq. (2) alone and of an answer.

    Attributes:
        result: the answer of the fitting part.
        before: Eq. (2) refitted, and draws.
        after: the reported structure, and draws under it alone.
        alone: the same draws, with how they were drawn.
        with_companions: draws of its parameters with companions included, likewise.
        mixture: draws of its parameters over all structures.
        larger: the reported structure with its companions.
        rivals: structures with a tied effect in place of a reported one, with their odds.
        rng: random numbers for further draws.
    """

    result: Conclusion
    before: Side
    after: Side
    alone: Draws
    with_companions: Draws
    mixture: MixedDraws
    larger: Trial
    rivals: list[tuple[Trial, float]]
    rng: np.random.Generator

    @cached_property
    def space(self) -> Space:
        """Working coordinates of the reported structure."""
        return Space(self.after.model, self.result.data.duration)

    @cached_property
    def ridge(self) -> Array:
        """Parameters along the ridge that one stiffness leaves open (n, p)."""
        return ridge.left_open(self.space, self.after.model, self.result.scorer, self.after.theta)

    def spread(self, complete: bool) -> tuple[Array, NDArray[np.bool_]]:
        """Return draws (m, p), each parameter spread as far as it is open; which are fixed (p,).

        Args:
            complete: whether nothing material is left; else the equations are wrong, and the
                spread that this causes is added.
        """
        draws, result = self.mixture.points, self.result
        if not complete:
            form = model_form.open_form(
                result.beam.refits,
                result.found.final,
                result.decision.left,
                self.space,
                result.scorer,
            )
            draws = model_form.widened(draws, form, self.space, self.rng)
        return posterior.opened(
            self.space, draws, self.ridge, self.with_companions.widening, self.rng
        )

    def estimates_before(self) -> dict[str, Estimate]:
        """Return what the records say of Eq. (2)'s parameters without any addition."""
        model, space = self.before.model, Space(self.before.model, self.result.data.duration)
        open_ridge = ridge.left_open(space, model, self.result.scorer, self.before.theta)
        drawn = posterior.opened(space, self.before.draws, open_ridge, (), self.rng)
        return estimates(space, model, *drawn)

    def pressed(self) -> tuple[Pressed, ...]:
        """Return parameters pressed against a bound, in physical units."""
        space = self.space
        names = tuple(p.name for p in self.after.model.parameters)
        lower, upper = space.theta(space.lower), space.theta(space.upper)
        out = []
        for p in pressed(space.z(self.after.draws), names, space.lower, space.upper):
            i = names.index(p.name)
            bound = float((lower if p.side == 'lower' else upper)[i])
            # Eq. (2)'s parameters are positive: the lower bound of their logarithms means zero.
            physical = p.physical or (i < len(BASE) and p.side == 'lower')
            out.append(replace(p, bound=bound, physical=physical))
        return tuple(out)


def sampled(
    result: Conclusion, evaluations: int, rng: np.random.Generator, each: Each, tell: Progress
) -> AnswerPosterior:
    """Draw the posterior of an answer.

    Args:
        result: the answer of the fitting part.
        evaluations: of the likelihood by chains of one structure, at most.
        rng: random numbers.
        each: evaluates draws, several at a time if it can.
        tell: takes progress.
    """
    found, decision, scorer = result.found, result.decision, result.scorer
    final, refits = found.final, result.beam.refits
    # One record's own setting differs from a common effect in size only: no small effects then.
    size = max(found.material, decision.left)
    small = {} if final.own is not None else discrepancy.responses(refits, size)

    def sample(trial: Trial, most: int = 0, stage: Stage = 'posterior') -> Draws:
        finer = trial.own is None and not trial.structure.linear
        return posterior.sample(
            trial.model,
            trial.fit,
            replace(scorer, data=replace(scorer.data, finer=finer)),
            beside=discrepancy.beside(small, trial.effects, scorer),
            rng=rng,
            evaluations=most,
            progress=partial(tell, stage),
            each=each,
        )

    def laplace(trial: Trial) -> Array:
        return sample(trial).points

    draws = sample(found.base, stage='posterior before')
    before = after = Side(found.base.model, found.base.fit.theta, draws.points)
    if final.effects:
        # Where structure is left, wrong equations widen intervals more than long chains would.
        whole = decision.verdict in COMPLETE
        draws = sample(final, evaluations // (1 if whole else 4))
        after = Side(final.model, final.fit.theta, draws.points)
    out = AnswerPosterior(
        result, before, after, draws, draws, MixedDraws.of(draws.points, final.effects), final,
        tied_structures(refits, found), rng,
    )  # fmt: skip
    # Beside a description a companion would only correct its form.
    named = not any_learned(final.structure)
    if named and decision.verdict in COMPLETE and not result.effort.over:
        out = replace(out, larger=companions.with_companions(result.beam, final))
    mixture = out.mixture
    # Chains that met in no parameter would meet with companions even less.
    apart = bool(draws.widening) and min(draws.widening) > 1.0
    if out.larger is not final and not apart:
        known = posterior.identified(out.space, draws.points, out.ridge).tolist()
        wider = sample(out.larger, evaluations)
        widening = reduced(wider, out.larger, final, known).widening
        if any(k and w > 1.0 for k, w in zip(known, widening, strict=True)):
            # Chains that lose what the records fix say nothing of what is too small to matter.
            out = replace(out, larger=final)
        else:
            mixture = MixedDraws.of(wider.points, out.larger.effects)
            if like := companions.alike(result.beam, final, out.larger):
                mixture = mixed(mixture, out.larger, like, laplace, rng)
            wider = wider._replace(points=mixture.points)
            draws = reduced(wider, out.larger, final, known)
            mixture = replace(mixture, points=draws.points)
    return replace(
        out, with_companions=draws, mixture=mixed(mixture, final, out.rivals, laplace, rng)
    )


def estimates(
    space: Space, model: Model, draws: Array, known: NDArray[np.bool_]
) -> dict[str, Estimate]:
    """Return what draws (m, p) say of each parameter, and whether the records fix it (p,)."""
    lower, upper = space.theta(space.lower), space.theta(space.upper)
    ends = np.quantile(draws, [0.025, 0.975], axis=0)
    return {
        p.name: Estimate(
            float(draws[:, i].mean()), float(draws[:, i].std(ddof=1)),
            float(ends[0, i]), float(ends[1, i]),
            p.unit, p.neutral, bool(known[i]), (float(lower[i]), float(upper[i])),
        )
        for i, p in enumerate(model.parameters)
    }  # fmt: skip


def reduced(draws: Draws, larger: Trial, final: Trial, known: Sequence[bool]) -> Draws:
    """Return the final structure's parameters in draws of the larger one.

    Args:
        draws: of the larger structure.
        larger: that structure.
        final: the reported structure.
        known: which of its parameters (p,) the records fix without the companions, which are too
            small to fix any.
    """
    theirs = [p.name for p in larger.model.parameters]
    columns = [theirs.index(p.name) for p in final.model.parameters]
    found = [draws.widening[i] if draws.widening else 1.0 for i in columns]
    widening = tuple(w if k else math.inf for w, k in zip(found, known, strict=True))
    return draws._replace(points=draws.points[:, columns], widening=widening)
