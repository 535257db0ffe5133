"""Posterior of base and effect parameters by DREAM(ZS) around the best fit."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from actuator_glue.inference import dream
from actuator_glue.inference.convergence import rhat
from actuator_glue.model.parameters import BASE
from actuator_glue.records import Array
from actuator_glue.residual.data import Data, Model, chunks
from actuator_glue.residual.fit import Fit, Space
from actuator_glue.residual.score import Scorer
from actuator_glue.residual.straight import coordinates

_P = len(BASE)
_REACH = 100.0  # of the sampled box, in standard deviations of the Laplace approximation
_HALVINGS = 40  # bring any point of it inside the bounds of the prior


def laplace(scorer: Scorer, fit: Fit, slopes: Array) -> tuple[Array, float]:
    """Covariance (p, p) of coordinates at the best fit and the noise inflation.

    `slopes` (p, p) are the derivatives of the working coordinates j with respect to these, i.

    The inflation is the mean square of the whitened error: where structure remains, every
    parameter is known less well than the noise alone says (Kennedy & O'Hagan 2001).
    """
    jac = slopes @ scorer.whiten(fit.jacobian)
    error = scorer.whiten(fit.error)
    inflation = max(1.0, float(np.mean(error**2)))
    scale = np.sqrt(np.maximum(np.einsum('pn,pn->p', jac, jac), 1e-300))
    normal = (jac / scale[:, None]) @ (jac / scale[:, None]).T
    covariance = np.linalg.pinv(normal, rcond=1e-10, hermitian=True) / np.outer(scale, scale)
    return np.asarray(inflation * covariance), inflation


def _scaled(covariance: Array, widest: Array) -> tuple[Array, Array]:
    """Standard deviations (p,) and correlations (p, p); `widest` (p,) where data say nothing.

    What the data say nothing about has a variance of 0 or of many decades: left in the covariance,
    it takes all digits from the directions that they do fix.
    """
    sd = np.sqrt(np.diag(covariance))
    told = sd > 0.0
    safe = np.where(told, sd, 1.0)
    correlation = covariance / np.outer(safe, safe)
    correlation[np.diag_indices(len(sd))] = 1.0
    return np.where(told, sd, widest), correlation


def identified(space: Space, draws: Array) -> NDArray[np.bool_]:
    """Which parameters the records fix (p,): draws (m, p) fill less than half of the bounds.

    Bounds of Eq. (2)'s parameters are decades wide: a factor of e^2 between the 2.5 and 97.5 %
    quantiles is no knowledge of one.
    """
    low, high = np.quantile(space.z(draws), [0.025, 0.975], axis=0)
    widest = 0.5 * (space.upper - space.lower)
    widest[:_P] = 2.0
    return np.asarray(high - low < widest)


def sample(
    data: Data,
    model: Model,
    fit: Fit,
    scorer: Scorer,
    *,
    rng: np.random.Generator,
    evaluations: int,
    progress: Callable[[float], None],
) -> tuple[Array, float]:
    """Draw (m, p) from the posterior, physical units; return the largest R-hat with the draws.

    Args:
        data: the fitting part.
        model: the structure.
        fit: its best fit.
        scorer: whitening filters of the noise.
        rng: random numbers.
        evaluations: likelihood evaluations; 0 returns draws of the Laplace approximation, and
            not-a-number for R-hat.
        progress: called with the share done.
    """
    space = Space(model, max(r.duration for r in data.records))
    around = coordinates(space, model, data, fit.z)
    phi = around.phi(fit.z)
    covariance, inflation = laplace(scorer, fit, around.slopes(phi))
    spread, correlation = _scaled(covariance, around.widest)
    spread = np.minimum(spread, around.widest)
    values, vectors = np.linalg.eigh(correlation)
    root = spread[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))

    def place(w: Array) -> tuple[Array, Array]:
        """Parameters and log prior (m,) where the Laplace approximation is standard normal."""
        return around.theta(phi + w @ root.T)

    def gaussian(count: int) -> Array:
        w = rng.standard_normal((count, len(phi)))
        for _ in range(_HALVINGS):
            outside = ~np.isfinite(place(w)[1])
            if not outside.any():
                break
            w[outside] *= 0.5
        return w

    if evaluations <= 0:
        return place(gaussian(500))[0], math.nan

    def log_density(w: Array) -> Array:
        theta, found = place(w)
        inside = np.isfinite(found)
        rows = np.flatnonzero(inside)
        for some in chunks(len(rows), data.target.size):
            error = scorer.whiten(data.target - data.simulate(model, theta[rows[some]]))
            sums = np.einsum('mn,mn->m', error, error)
            found[rows[some]] -= np.where(np.isfinite(sums), 0.5 * sums / inflation, np.inf)
        return found

    box = np.full(len(phi), _REACH)
    settings = dream.Settings(chains=32, population=128, sweeps=2, adaptation=20)
    chains = dream.sample(
        rng,
        log_density,
        -box,
        box,
        evaluations=evaluations,
        settings=settings,
        archive=gaussian(320),
        progress=lambda done, all_: progress(done / all_),
    )
    kept = chains.draws[chains.burn :]
    return place(kept.reshape(-1, len(phi)))[0], float(rhat(kept).max())
