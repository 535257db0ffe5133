"""Posterior of base and effect parameters around the best fit.

Where it is nearly linear importance sampling draws from it, and knows that it did; else DREAM(ZS).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from actuator_glue.diagnosis import proposals
from actuator_glue.diagnosis.data import LANES, Data, Model, chunks
from actuator_glue.diagnosis.discrepancy import Discrepancy, ScaleMixture
from actuator_glue.diagnosis.fit import Fit
from actuator_glue.diagnosis.fit import fit as fit_to
from actuator_glue.diagnosis.identifiable import Straight, Working, coordinates, derivatives
from actuator_glue.diagnosis.score import Scorer
from actuator_glue.diagnosis.search import Each
from actuator_glue.diagnosis.space import Space
from actuator_glue.inference import importance, posterior
from actuator_glue.inference.chains import Chains
from actuator_glue.inference.convergence import quick_rhat_and_ess
from actuator_glue.inference.settings import SamplerSettings
from actuator_glue.inference.transforms import Composed
from actuator_glue.inference.transforms.laplace import Laplace
from actuator_glue.json_value import Json, json_value
from actuator_glue.model.parameters import BASE
from actuator_glue.records import Array

_P = len(BASE)
_STEPS = 8  # from the least-squares fit to the optimum of the likelihood
# Draws will do for 95 % intervals and bands from here on (Vehtari et al. 2021), with few in each
# of many chains.
_ESS, RHAT = 400.0, 1.05
_HALVINGS = 40  # bring any point of it inside the bounds of the prior
# From the optimum of the whitened error to that of the likelihood: a step that gains less than
# this is none.
_NATS, _MOST_STEPS = 0.5, 10


class Draws(NamedTuple):
    """Draws of a posterior and what tells how good they are.

    Attributes:
        points: (m, p), physical units.
        method: what drew them.
        evaluations: of the likelihood.
        effective: how many draws they are worth, the least of all parameters.
        rhat: largest R-hat of chains, else not-a-number.
        pareto_k: shape of the tail of importance weights, else not-a-number.
        unmet: of each parameter whether chains have not met in it; empty without chains.
    """

    points: Array
    method: Literal['laplace', 'importance', 'dream']
    evaluations: int = 0
    effective: float = math.nan
    rhat: float = math.nan
    pareto_k: float = math.nan
    unmet: tuple[bool, ...] = ()

    def told(self) -> Json:
        """Return how they were drawn, as JSON."""
        return {
            'method': self.method,
            'evaluations': self.evaluations,
            'effective_draws': json_value(self.effective),
            'rhat': json_value(self.rhat),
            'pareto_k': json_value(self.pareto_k),
        }


@dataclass(frozen=True)
class Whitened(Data):
    """The same samples, whitened: least squares on them is most likely."""

    scorer: Scorer = field(kw_only=True)

    @cached_property
    def target(self) -> Array:
        """As `Data.target`, whitened."""
        pairs = zip(self.records, self.masks, strict=True)
        return self.scorer.whiten(np.concatenate([r.measured[mask] for r, mask in pairs]))

    def simulate(self, model: Model, theta: Array) -> Array:
        """As `Data.simulate`, whitened."""
        return self.scorer.whiten(super().simulate(model, theta))


def most_likely(data: Data, model: Model, found: Fit, scorer: Scorer) -> Fit:
    """Go on from the least-squares fit to the optimum of the likelihood that is sampled.

    Under slow noise they are up to 12 nats apart; a covariance of the likelihood belongs to its
    own optimum. What is simulated and compared stays the least-squares fit: where structure
    remains, it is nearer in the error itself. Error and Jacobian of what is returned are whitened.
    """
    white = Whitened(**{f.name: getattr(data, f.name) for f in fields(Data)}, scorer=scorer)
    return fit_to(white, model, found.theta, iterations=_STEPS)


def inflation(error: Array) -> float:
    """Variance of whitened noise that a whitened error (N,) asks for, at least 1.

    Where structure remains, every parameter is known less well than the noise alone says.
    """
    return max(1.0, float(np.mean(error**2)))


def identified(space: Space, draws: Array) -> NDArray[np.bool_]:
    """Which parameters the records fix (p,): draws (m, p) fill less than half of the bounds.

    Bounds of Eq. (2)'s parameters are decades wide: a factor of e^2 between the 2.5 and 97.5 %
    quantiles is no knowledge of one.
    """
    low, high = np.quantile(space.z(draws), [0.025, 0.975], axis=0)
    widest = 0.5 * (space.upper - space.lower)
    widest[:_P] = 2.0
    return np.asarray(high - low < widest)


def _inside(around: Working | Straight, phi: Array, move: Array) -> Array:
    """Return coordinates (p,) moved as far as they mean something."""
    move = np.clip(move, -around.widest, around.widest)
    for _ in range(_HALVINGS):
        if np.isfinite(around.inverse((phi + move)[None])[1][0]):
            return phi + move
        move *= 0.5
    return phi


def _optimum(
    around: Working | Straight,
    phi: Array,
    linearised: Callable[[Array], tuple[float, ScaleMixture]],
) -> tuple[Array, ScaleMixture]:
    """Return the optimum (p,) of a likelihood from where it is linear about, and moves from it.

    The allowance may take a long record thousands of nats from the optimum without it, over which
    no response is linear.

    Args:
        around: the coordinates.
        phi: where to begin, (p,).
        linearised: of coordinates (p,) the log density, and where the parameters were if all
            were linear.
    """
    value, moves = linearised(phi)
    centre, best, new = phi, value, _inside(around, phi, moves.moments()[0])
    for step in range(1, _MOST_STEPS):
        value, found = linearised(new)
        # The first move is to a mean, from where there may be next to nothing to gain.
        if not value > best + (_NATS if step > 1 else -_NATS):
            break
        centre, best, moves = new, value, found
        new = _inside(around, centre, moves.moments()[0])
    return centre, moves


def _loosened(
    around: Working | Straight, theta: Array, move: Array, rng: np.random.Generator
) -> Array:
    """Spread draws (m, p) by how far the allowance moved the optimum, once to either side.

    What took up the error are the catalogue's shapes, not the machine's: where they move a
    parameter from where it stands without them, it is not known better than by that.
    """
    phi, step = around.forward(theta), rng.standard_normal((len(theta), 1)) * move
    for shorter in (-1.0, *(-0.5,) * _HALVINGS):
        out, log_prior = around.inverse(phi + step)
        outside = ~np.isfinite(log_prior)
        if not outside.any():
            return out
        step[outside] *= shorter  # to the other side first
    return np.where(outside[:, None], theta, out)


def _enough(chains: Chains) -> bool:
    rhat, ess = quick_rhat_and_ess(chains.kept)
    return bool(ess.min() >= _ESS and rhat.max() <= RHAT)


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
        beside: what may be there beside the structure.
        rng: random numbers.
        evaluations: likelihood evaluations of chains at most; 0 returns draws of the Laplace
            approximation.
        progress: called with the share done.
        each: evaluates some draws at a time: `map`, or that of a pool of threads.
    """
    data = scorer.data
    fit = most_likely(data, model, fit, scorer)
    space = Space(model, max(r.duration for r in data.records))
    around = coordinates(space, model, data, fit.z)
    phi = around.forward(fit.theta[None])[0]
    noise = inflation(beside.without(fit.error))
    size, target = math.sqrt(noise), data.target
    whitened = scorer.whiten(target)

    def response(theta: Array) -> Array:
        found = scorer.whiten(data.simulate(model, theta))
        if data.prior is None:
            return found
        return np.hstack([found, size * data.prior.pull(space.z(theta))])

    def of_some(theta: Array) -> Array:
        error = data.simulate(model, theta)
        with np.errstate(all='ignore'):
            error = scorer.whiten(np.subtract(target, error, out=error))
            return beside.log_likelihood(error, noise)

    def log_likelihood(theta: Array) -> Array:
        # As many as the kernels take at once, where there are more than chains.
        least = LANES if len(theta) > 2 * LANES else LANES // 2
        parts = chunks(len(theta), target.size, least)
        found = np.concatenate(list(each(of_some, [theta[some] for some in parts])))
        # Uniform in the logarithms otherwise.
        return found if data.prior is None else found + data.prior.log_density(theta)

    def linearised(phi: Array) -> tuple[float, ScaleMixture]:
        theta, log_prior = around.inverse(phi[None])
        value = float(log_likelihood(theta)[0] + log_prior[0])
        if not math.isfinite(value):  # it diverges there: nothing is known
            no_move = np.zeros((1, len(phi))), np.diag(around.widest**2)[None]
            return value, ScaleMixture(np.ones(1), *no_move)
        seen, jac = derivatives(around, space, phi, response)
        error = np.concatenate([whitened, np.zeros(len(seen) - len(whitened))]) - seen
        return value, beside.gaussians(jac, error, noise, around.widest)

    centre, moves = _optimum(around, phi, linearised)
    laplace = Composed(around, Laplace(centre, moves.moments()[1], around.widest))

    def loosened(points: Array) -> Array:
        return _loosened(around, points, centre - phi, rng)

    if evaluations <= 0:
        w = rng.standard_normal((500, len(phi)))
        for _ in range(_HALVINGS):
            outside = ~np.isfinite(laplace.inverse(w)[1])
            if not outside.any():
                break
            w[outside] = rng.standard_normal((int(outside.sum()), len(phi)))
        w[~np.isfinite(laplace.inverse(w)[1])] = 0.0
        return Draws(loosened(laplace.inverse(w)[0]), 'laplace')

    bounds = space.theta(space.lower), space.theta(space.upper)
    transform, start = proposals.proposed(around, centre, moves)
    goal = posterior.Target(log_likelihood, bounds, transform)
    seed = [int(word) for word in rng.integers(0, 2**32, 3)]
    found = importance.sample(
        np.random.default_rng((*seed, 1)), goal.density(), start, _ESS, progress
    )
    if found is not None:
        points = loosened(transform.inverse(found.points)[0])
        return Draws(points, 'importance', len(points), found.effective, pareto_k=found.pareto_k)
    # None of the archive's points may be impossible; the fit, at least, is not.
    near = np.concatenate([start.draw(rng, 480), transform.forward(around.inverse(phi[None])[0])])
    near = near[np.isfinite(transform.inverse(near)[1])]
    chains = posterior.sample(
        goal,
        seed,
        evaluations,
        settings=SamplerSettings(chains=32, population=128, steps=2, adaptation=20, parts=48),
        archive=rng.choice(near, 320),
        enough=_enough,
        progress=lambda done, all_: progress(done / all_),
    )
    return Draws(
        loosened(chains.posterior()),
        'dream',
        chains.evaluations,
        effective=float(chains.ess.min()),
        rhat=float(chains.rhat.max()),
        unmet=tuple(bool(r > RHAT) for r in chains.rhat),
    )
