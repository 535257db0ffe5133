"""The shaping factor G of one window: given, or from the autocorrelation of its own residual."""

from __future__ import annotations

import numpy as np
import scipy

from actuator_glue.errors import InputError
from actuator_glue.inference.choice import ModelChoice
from actuator_glue.inference.effective_size import effective_size
from actuator_glue.online import fitting
from actuator_glue.records import Array, Record

# Trial points in the box, where no earlier window gives a starting point.
_TRIALS = 64
_ITERATIONS = 12
# Finite differences, as shares of the box.
_STEP = 1e-4
# Displacement to which diverging responses are clipped, so that all are equally bad.
_ABSURD = 1.0  # m


def automatic(record: Record, model: ModelChoice, settle: int, near: Array | None) -> float:
    """Return half the number of independent samples that the best fit's residual is worth.

    The fit is by least squares, from an earlier window's posterior where there is one. The same
    samples and the same start give the same factor, as a replay needs.

    Args:
        record: samples of the window, n.
        model: what is fitted, p parameters.
        settle: samples at the start that do not count.
        near: parameters (p,) near the best fit, where known.

    Raises:
        InputError: as `fitting.simulate`.
    """
    lower, upper = model.bounds
    width = upper - lower
    measured = record.measured[settle:]

    def respond(shares: Array) -> Array:
        with np.errstate(over='ignore', invalid='ignore'):
            found = fitting.simulate(model, lower + shares * width, record)[:, settle:]
        return np.clip(np.nan_to_num(found, nan=_ABSURD), -_ABSURD, _ABSURD)

    def error(shares: Array) -> Array:
        return np.asarray(measured - respond(shares[np.newaxis])[0])

    def slopes(shares: Array) -> Array:
        # Inwards at the upper bound.
        steps = np.where(shares + _STEP > 1.0, -_STEP, _STEP)
        found = respond(np.vstack([shares, shares + np.diag(steps)]))
        return np.asarray((found[1:] - found[0]) / steps[:, np.newaxis])

    def descent(shares: Array) -> Array:
        return -slopes(shares).T

    if near is None:
        # A Latin hypercube: scipy's samplers take a worker a second more to start.
        levels = np.tile((np.arange(_TRIALS) + 0.5) / _TRIALS, (len(width), 1))
        trials = np.random.default_rng(0).permuted(levels, axis=1).T
        start = trials[np.argmin(((measured - respond(trials)) ** 2).sum(axis=1))]
    else:
        start = (near - lower) / width
    best = scipy.optimize.least_squares(
        error,
        np.clip(start, 1e-6, 1.0 - 1e-6),
        jac=descent,
        bounds=(0.0, 1.0),
        x_scale='jac',
        max_nfev=_ITERATIONS,
    )
    try:
        moved = record.command[settle:], measured
        return 0.5 * effective_size([best.fun], [slopes(best.x)], [moved])
    except InputError:
        # Nothing is left to explain: every sample counts.
        return 0.5 * len(measured)
