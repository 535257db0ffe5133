"""How far uncertain parameters move a simulation, and the error that none of them removes."""

from __future__ import annotations

import numpy as np
import scipy

from actuator_glue.inference.least_squares.data import Data, chunks
from actuator_glue.inference.least_squares.fit import rms
from actuator_glue.inference.least_squares.free_run import Model
from actuator_glue.records import Array

_DRAWS = 100  # of parameters, for the bands
# Samples of all draws' simulations that are kept side by side.
_KEPT = 20_000_000


def spread(
    data: Data,
    model: Model,
    centre: Array,
    draws: Array,
    rng: np.random.Generator,
    *,
    reach: bool = False,
) -> tuple[Array, float | None]:
    """Standard deviation of the simulation over posterior draws, and the error they can reach.

    Args:
        data: records and the samples of each that count.
        model: simulates them.
        centre: what the best parameters simulate, (N,) [m].
        draws: of their posterior, (m, p).
        rng: random numbers, for a choice of draws.
        reach: whether the error is asked for.

    Returns:
        The standard deviation (N,) [m], and the rms error [m], see `reached`; None if not asked.
    """
    rows = rng.integers(0, len(draws), min(_DRAWS, len(draws)))
    every = max(1, len(rows) * centre.size // _KEPT)
    count, total, squares = 0, np.zeros_like(centre), np.zeros_like(centre)
    kept: list[Array] = []
    for some in chunks(len(rows), data.target.size):
        off = data.simulate(model, draws[rows[some]]) - centre
        off = off[np.isfinite(off).all(axis=1)]
        count += len(off)
        total += off.sum(axis=0)
        squares += np.einsum('mn,mn->n', off, off)
        if reach:
            kept.append(off[:, ::every].copy())
    error = data.target - centre
    if count < 2:
        return np.zeros_like(centre), rms(error) if reach else None
    deviation = np.asarray(np.sqrt(np.maximum(squares / count - (total / count) ** 2, 0.0)))
    if not reach:
        return deviation, None
    thin = error[::every]
    share = reached(thin, np.vstack(kept), draws.shape[1]) / max(rms(thin), 1e-300)
    return deviation, rms(error) * share


def reached(error: Array, off: Array, parameters: int) -> float:
    """The least rms error of parameters in the 95 % region of their posterior, to first order [m].

    Open parameters do not excuse an error in another direction: where no such parameters remove
    it, it is the model's. Least squares over the distances of draws from the best parameters,
    their weights within the 95 % region of a normal posterior.

    Args:
        error: of the best parameters, (N,) [m].
        off: what draws simulate less what the best parameters do, (m, N) [m].
        parameters: how many there are.
    """
    values, vectors = np.linalg.eigh(off @ off.T / len(off))
    main = np.argsort(values)[::-1][:parameters]
    main = main[values[main] > 1e-12 * values.max()]
    if not main.size:
        return rms(error)
    # Unit steps of the posterior move the simulation orthogonally, by mean squares `sizes`.
    sizes = values[main]
    along = vectors[:, main].T @ (off @ error) / np.sqrt(len(off))
    most = float(scipy.stats.chi2.ppf(0.95, parameters))

    def beyond(log: float) -> float:
        return float(np.sum((along / (sizes + np.exp(log))) ** 2)) - most

    # Steps minimise the remaining error, with a sum of squares of at most `most`.
    low, high = np.log(sizes.min()) - 40.0, np.log(sizes.max() + np.abs(along).max()) + 40.0
    weight = 0.0 if beyond(low) <= 0.0 else float(np.exp(scipy.optimize.brentq(beyond, low, high)))
    steps = along / (sizes + weight)
    left = float(error @ error) - float(2.0 * steps @ along - steps @ (sizes * steps))
    return float(np.sqrt(max(left, 0.0) / error.size))
