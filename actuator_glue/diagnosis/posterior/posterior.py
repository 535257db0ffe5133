"""Posterior of base and effect parameters around the best fit.

Where it is nearly linear, importance sampling draws from it, and tells whether it succeeded; else
DREAM(ZS) does.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from actuator_glue.diagnosis.posterior import proposals
from actuator_glue.diagnosis.posterior.discrepancy import Discrepancy
from actuator_glue.diagnosis.posterior.identifiable import Straight, Working, coordinates
from actuator_glue.diagnosis.posterior.likelihood import Likelihood, Optimum, most_likely
from actuator_glue.diagnosis.refits import poles
from actuator_glue.diagnosis.score.scorer import Scorer, inflation
from actuator_glue.errors import InputError
from actuator_glue.inference import importance, posterior
from actuator_glue.inference.chains import Chains
from actuator_glue.inference.convergence import APART, quick_rhat_and_ess
from actuator_glue.inference.least_squares.each import Each
from actuator_glue.inference.least_squares.fit import Fit
from actuator_glue.inference.least_squares.free_run import Model
from actuator_glue.inference.least_squares.space import Space
from actuator_glue.inference.settings import SamplerSettings
from actuator_glue.inference.transforms import Composed, Transform
from actuator_glue.inference.transforms.laplace import Laplace
from actuator_glue.json_value import Json, json_value
from actuator_glue.model.parameters import BASE
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array

_P = len(BASE)
_ALPHA_2 = [p.name for p in BASE].index('alpha_2')
_DRAWS = 500  # of the normal approximation
# Effective draws and R-hat that suffice for 95 % intervals and bands (Vehtari et al. 2021), with
# few draws in each of many chains.
_ESS, RHAT = 400.0, 1.05
_MOVES_WITH = 0.9  # rank correlation
_UNLIKELY = 10.0  # nats behind the first optimum: another one has next to no share
_HALVINGS = 40  # bring any point inside the bounds of the prior
_STARTS = 320  # points that chains start among
# Samples that chains may simulate in all evaluations together, and evaluations that they may make
# anyway. Ten minutes of 10 kHz take 4 ms each: where 2600 did not suffice, 12 000 did not either,
# as a ridge was left. Of five shorter records whose chains had not converged after some 4000, one
# had after 12 000.
_SIMULATED, _FEWEST = 200_000_000, 2_600
# Evaluations from which on chains are given up that would be apart at their last one even if
# R-hat - 1 fell with the square of their number: from there on it fell with powers of 0.4 and 0.6
# for two machines whose chains stayed apart.
_TRIED = 4_000


class Draws(NamedTuple):
    """Draws of a posterior and what tells how good they are.

    Attributes:
        points: (m, p), physical units.
        method: what drew them.
        evaluations: of the likelihood.
        effective: effective sample size, the least of all parameters.
        rhat: largest R-hat of chains, else not-a-number.
        pareto_k: shape of the tail of importance weights, else not-a-number.
        widening: per parameter, the factor by which draws are to be spread: 1, R-hat where chains
            are apart, infinite where the parameter is open; empty without chains.
    """

    points: Array
    method: Literal['laplace', 'importance', 'dream']
    evaluations: int = 0
    effective: float = math.nan
    rhat: float = math.nan
    pareto_k: float = math.nan
    widening: tuple[float, ...] = ()

    def to_json(self) -> Json:
        """Return how they were drawn, as JSON."""
        return {
            'method': self.method,
            'evaluations': self.evaluations,
            'effective_draws': json_value(self.effective),
            'rhat': json_value(self.rhat),
            'pareto_k': json_value(self.pareto_k),
        }


def identified(space: Space, draws: Array, ridge: Array) -> NDArray[np.bool_]:
    """Which parameters the records fix (p,): draws (m, p) fill less than half of the bounds.

    Bounds of Eq. (2)'s parameters are decades wide: a factor of e^2 between the 2.5 and 97.5 %
    quantiles is no knowledge of one. Where alpha_2 is open, draws reach along the ridge that one
    stiffness leaves only as far as `identifiable.py` lets them: parameters that move with it are
    open, too, and so are those that move along `ridge` (n, p), whose points fit as well, by more
    than draws spread.
    """
    z, moved = space.z(draws), np.ptp(space.z(ridge), axis=0)
    low, high = np.quantile(z, [0.025, 0.975], axis=0)
    widest = 0.5 * (space.upper - space.lower)
    widest[:_P] = 2.0
    known = np.asarray((high - low < widest) & (moved <= high - low))
    if not known[_ALPHA_2]:
        ranks = np.argsort(np.argsort(z, axis=0), axis=0)
        known &= np.abs(np.corrcoef(ranks.T)[_ALPHA_2]) < _MOVES_WITH
    return known


def opened(
    space: Space, draws: Array, ridge: Array, widening: Sequence[float], rng: np.random.Generator
) -> tuple[Array, NDArray[np.bool_]]:
    """Spread draws as far as the records leave each parameter open.

    Chains that are apart together spread as far as they began, and further by R-hat, the factor by
    which their scale may still change (Gelman & Rubin 1992). Evenly in the working coordinates:
    over the ridge where draws do not reach its ends, over the bounds where a parameter is open.
    Intervals are quantiles of what is returned.

    Args:
        space: working coordinates.
        draws: of all parameters (m, p), physical units.
        ridge: parameters that fit as well (n, p).
        widening: per parameter, as `Draws.widening`.
        rng: random numbers.

    Returns:
        The draws (m, p) and which parameters the records fix (p,).
    """
    z, far = space.z(draws), space.z(ridge)
    by = np.array(widening) if widening else np.ones(z.shape[1])
    open_, apart = np.isinf(by), np.isfinite(by) & (by > 1.0)
    middle = np.median(z[:, apart], axis=0)
    z[:, apart] = np.clip(
        middle + by[apart] * (z[:, apart] - middle), space.lower[apart], space.upper[apart]
    )
    out = draws.copy()
    out[:, apart] = space.theta(z)[:, apart]
    known = identified(space, out, ridge)
    low, high = np.quantile(z, [0.025, 0.975], axis=0)
    ends = np.minimum(low, far.min(axis=0)), np.maximum(high, far.max(axis=0))
    evenly = open_ | (~known & ((ends[0] < low) | (ends[1] > high)))
    ends = np.where(open_, space.lower, ends[0]), np.where(open_, space.upper, ends[1])
    z[:, evenly] = rng.uniform(ends[0][evenly], ends[1][evenly], (len(z), int(evenly.sum())))
    out[:, evenly] = space.theta(z)[:, evenly]
    return out, known & ~open_


def _loosened(
    around: Working | Straight, theta: Array, move: Array, rng: np.random.Generator
) -> Array:
    """Spread draws (m, p), to either side, by how far the discrepancy moved the optimum.

    The discrepancy has the catalogue's shapes, not the machine's: a parameter that it moves is not
    known better than by that move.
    """
    phi, step = around.forward(theta), rng.standard_normal((len(theta), 1)) * move
    for shorter in (-1.0, *(-0.5,) * _HALVINGS):
        out, log_prior = around.inverse(phi + step)
        outside = ~np.isfinite(log_prior)
        if not outside.any():
            return out
        step[outside] *= shorter  # to the other side first
    return np.where(outside[:, None], theta, out)


def _normal(laplace: Composed, count: int, rng: np.random.Generator) -> Array:
    """Draw points (m, p) of a normal approximation, inside the bounds; `count` is p."""
    w = rng.standard_normal((_DRAWS, count))
    for _ in range(_HALVINGS):
        outside = ~np.isfinite(laplace.inverse(w)[1])
        if not outside.any():
            break
        w[outside] = rng.standard_normal((int(outside.sum()), count))
    w[~np.isfinite(laplace.inverse(w)[1])] = 0.0
    return laplace.inverse(w)[0]


def _inside(transform: Transform, points: Array, towards: Array) -> Array:
    """Pull points (m, p) towards a possible one (p,) until none is impossible.

    Near a bound, all draws of the linear approximation may lie beyond it.
    """
    for _ in range(_HALVINGS):
        outside = ~np.isfinite(transform.inverse(points)[1])
        if not outside.any():
            return points
        points[outside] = towards + 0.5 * (points[outside] - towards)
    return np.asarray(points[~outside])


def _exchanged(likelihood: Likelihood, fit: Fit, first: Optimum) -> list[Optimum]:
    """Return further optima, with the poles in another order, that are about as likely."""
    model, data = likelihood.model, likelihood.scorer.data
    if not isinstance(model, Structure):
        return []
    stiffness = frozenset(r.known_stiffness() for r in data.records)
    rows = [r for n in model.effects for r in poles.exchanged(model, n, fit.theta, stiffness)]
    known = [first]
    for row in rows:
        theta = most_likely(data, model, row, likelihood.scorer).theta
        found = likelihood.optimum(likelihood.around.forward(theta[None])[0])
        likely = found.log_mass() > first.log_mass() - _UNLIKELY
        if likely and not any(found.is_about(other) for other in known):
            known.append(found)
    return known[1:]


def _ended(chains: Chains, most: int) -> bool:
    """Whether more draws are not needed, or those up to `most` evaluations would not help."""
    rhat, ess = quick_rhat_and_ess(chains.kept)
    worst = float(rhat.max())
    return bool(ess.min() >= _ESS and worst <= RHAT) or hopeless(worst, chains.evaluations, most)


def hopeless(rhat: float, evaluations: int, most: int) -> bool:
    """Return whether chains will still be apart when all evaluations are made.

    Args:
        rhat: the largest of all parameters; not a number before there is one.
        evaluations: so far.
        most: that may be made.
    """
    left = (rhat - 1.0) * (evaluations / most) ** 2
    return evaluations >= _TRIED and left > APART - 1.0


def sample(
    model: Model,
    fit: Fit,
    scorer: Scorer,
    *,
    beside: Discrepancy,
    rng: np.random.Generator,
    evaluations: int,
    progress: Callable[[float], None],
    each: Each = map,
) -> Draws:
    """Draw from the posterior of a structure.

    Args:
        model: the structure.
        fit: its least-squares fit.
        scorer: the fitting part, and whitening filters of its noise.
        beside: discrepancy of small effects that the structure lacks.
        rng: random numbers.
        evaluations: likelihood evaluations of chains at most, fewer of a long record; 0 returns
            draws of the Laplace approximation.
        progress: called with the share done.
        each: evaluates some draws at a time: `map`, or that of a pool of threads.
    """
    fit = most_likely(scorer.data, model, fit.theta, scorer)
    space = Space(model, scorer.data.duration)
    around = coordinates(space, model, scorer.data, fit.z)
    phi = around.forward(fit.theta[None])[0]
    noise = inflation(beside.without(fit.error))
    likelihood = Likelihood(model, scorer, beside, noise, space, around, each)
    first = likelihood.optimum(phi)

    def loosened(points: Array) -> Array:
        return _loosened(around, points, first.centre - phi, rng)

    def approximated() -> Draws:
        normal = Laplace(first.centre, first.moves.moments()[1], around.widest)
        return Draws(loosened(_normal(Composed(around, normal), len(phi), rng)), 'laplace')

    if evaluations <= 0:
        return approximated()

    bounds = space.theta(space.lower), space.theta(space.upper)
    optima = [first, *_exchanged(likelihood, fit, first)]
    transform, start = proposals.proposed(around, optima)
    goal = posterior.Target(likelihood, bounds, transform)
    seed = [int(word) for word in rng.integers(0, 2**32, 3)]
    found, reached = importance.sample(
        np.random.default_rng((*seed, 1)), goal.density(), start, _ESS, progress
    )
    if found is not None:
        points = loosened(transform.inverse(found.points)[0])
        return Draws(points, 'importance', len(points), found.effective, pareto_k=found.pareto_k)
    affordable = min(evaluations, max(_FEWEST, _SIMULATED // scorer.data.simulated(model)))
    # Chains begin where importance sampling came to, and as far apart as it began.
    wide = np.concatenate([start.draw(rng, _STARTS // 2), reached.draw(rng, _STARTS // 2)])
    near = _inside(transform, wide, transform.forward(around.inverse(first.centre[None])[0])[0])
    try:
        chains = posterior.sample(
            goal,
            seed,
            affordable,
            settings=SamplerSettings(chains=64, population=128, steps=2, adaptation=20, parts=48),
            archive=near,
            enough=partial(_ended, most=affordable),
            progress=lambda done, all_: progress(done / all_),
        )
    except InputError:
        # No draws in time, or a structure pressed against its bounds, around which no point is
        # possible: `method` says that they are approximated.
        return approximated()
    return Draws(
        loosened(chains.posterior()),
        'dream',
        chains.evaluations,
        effective=float(chains.ess.min()),
        rhat=float(chains.rhat.max()),
        widening=tuple(float(r) if r > APART else 1.0 for r in chains.rhat),
    )
