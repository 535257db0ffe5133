"""Posterior of base and effect parameters by DREAM(ZS) around the best fit."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, fields
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from actuator_glue.diagnosis.data import Data, Model, chunks
from actuator_glue.diagnosis.discrepancy import Discrepancy
from actuator_glue.diagnosis.fit import Fit, Space
from actuator_glue.diagnosis.fit import fit as fit_to
from actuator_glue.diagnosis.identifiable import Straight, Working, coordinates, derivatives
from actuator_glue.diagnosis.score import Scorer
from actuator_glue.diagnosis.search import Each
from actuator_glue.inference import posterior
from actuator_glue.inference.chains import Chains
from actuator_glue.inference.convergence import quick_rhat_and_ess
from actuator_glue.inference.settings import SamplerSettings
from actuator_glue.inference.transforms import Composed
from actuator_glue.inference.transforms.laplace import Laplace
from actuator_glue.model.parameters import BASE
from actuator_glue.records import Array

_P = len(BASE)
_STEPS = 8  # from the least-squares fit to the optimum of the likelihood
# Draws will do for 95 % intervals and bands from here on (Vehtari et al. 2021), with few in each
# of many chains.
_ESS, _RHAT = 400.0, 1.05
_HALVINGS = 40  # bring any point of it inside the bounds of the prior


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
    return bool(ess.min() >= _ESS and rhat.max() <= _RHAT)


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
) -> tuple[Array, float]:
    """Draw (m, p) from the posterior, physical units; return the largest R-hat with the draws.

    Args:
        model: the structure.
        fit: its least-squares fit.
        scorer: the fitting part, and whitening filters of its noise.
        beside: what may be there beside the structure.
        rng: random numbers.
        evaluations: likelihood evaluations at most; 0 returns draws of the Laplace approximation,
            and not-a-number for R-hat.
        progress: called with the share done.
        each: evaluates some draws at a time: `map`, or that of a pool of threads.
    """
    data = scorer.data
    fit = most_likely(data, model, fit, scorer)
    space = Space(model, max(r.duration for r in data.records))
    around = coordinates(space, model, data, fit.z)
    phi = around.forward(fit.theta[None])[0]
    error, noise = fit.error, inflation(beside.without(fit.error))
    size = math.sqrt(noise)

    def response(theta: Array) -> Array:
        found = scorer.whiten(data.simulate(model, theta))
        if data.prior is None:
            return found
        return np.hstack([found, size * data.prior.pull(space.z(theta))])

    jac = derivatives(around, space, phi, response)
    if data.prior is not None:
        error = np.concatenate([error, -size * data.prior.pull(fit.z)])
    move, covariance = beside.gaussian(jac, error, noise, around.widest)
    centre = _inside(around, phi, move)
    transform = Composed(around, Laplace(centre, covariance, around.widest))

    def gaussian(count: int) -> Array:
        w = rng.standard_normal((count, len(phi)))
        for _ in range(_HALVINGS):
            outside = ~np.isfinite(transform.inverse(w)[1])
            if not outside.any():
                break
            w[outside] = rng.standard_normal((int(outside.sum()), len(phi)))
        w[~np.isfinite(transform.inverse(w)[1])] = 0.0
        return w

    if evaluations <= 0:
        draws = transform.inverse(gaussian(500))[0]
        return _loosened(around, draws, centre - phi, rng), math.nan

    target = data.target

    def of_some(theta: Array) -> Array:
        error = scorer.whiten(target - data.simulate(model, theta))
        with np.errstate(all='ignore'):
            likely = beside.log_likelihood(error, noise)
        return np.where(np.isfinite(likely), likely, -np.inf)

    def log_likelihood(theta: Array) -> Array:
        parts = chunks(len(theta), target.size)
        found = np.concatenate(list(each(of_some, [theta[some] for some in parts])))
        # Uniform in the logarithms otherwise.
        return found if data.prior is None else found + data.prior.log_density(theta)

    bounds = space.theta(space.lower), space.theta(space.upper)
    chains = posterior.sample(
        posterior.Target(log_likelihood, bounds, transform),
        [int(word) for word in rng.integers(0, 2**32, 3)],
        evaluations,
        settings=SamplerSettings(chains=32, population=128, steps=2, adaptation=20, parts=48),
        archive=gaussian(320),
        enough=_enough,
        progress=lambda done, all_: progress(done / all_),
    )
    draws = _loosened(around, chains.posterior(), centre - phi, rng)
    return draws, float(chains.rhat.max())
