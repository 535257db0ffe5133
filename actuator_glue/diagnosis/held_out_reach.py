"""Whether parameters that the fitting part does not exclude explain the held-out part, too.

Along a ridge of hundreds of per cent nothing is linear: to first order (simulation_spread.py), a
machine tested under one stiffness only is another one under the next. So both parts are refitted
together, and the cost of that in the fitting part is checked.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import scipy

from actuator_glue.diagnosis.gains import standard_error
from actuator_glue.diagnosis.held_out import HeldOutError
from actuator_glue.diagnosis.held_out_look import Side
from actuator_glue.diagnosis.score import Scorer
from actuator_glue.diagnosis.verdict import misses, takes_nothing
from actuator_glue.inference.least_squares.data import LANES, Data
from actuator_glue.inference.least_squares.fit import fit, rms
from actuator_glue.inference.least_squares.free_run import Model
from actuator_glue.inference.least_squares.space import sum_of_squares
from actuator_glue.records import Array

_STARTS = 3  # draws that are nearest to the held-out part, beside the best fit
_SURE = 2.0  # standard errors over the blocks


def reached_by_both(
    error: HeldOutError, material: float, scorer: Scorer, held: Data, before: Side, after: Side
) -> HeldOutError:
    """Note the error of parameters that fit both parts, if the best fit leaves structure.

    Args:
        error: held-out error, with what is reached to first order.
        material: smallest error that matters [m].
        scorer: the fitting part, and whitening filters of its noise.
        held: the held-out part.
        before: Eq. (2) as fitted.
        after: with the additions.
    """
    if misses(error, material):
        found = reached(scorer, held, after)
        error = error if found is None else replace(error, reached=found)
    if len(after.theta) > len(before.theta) and takes_nothing(error, material):
        without = reached(scorer, held, before)
        error = replace(error, reached_before=error.before if without is None else without)
    return error


def reached(scorer: Scorer, held: Data, side: Side) -> float | None:
    """Return the held-out rms error of parameters refitted to both parts [m].

    Args:
        scorer: the fitting part, and whitening filters of its noise.
        held: the held-out part.
        side: the structure, its best parameters for the fitting part, draws of its posterior.

    Returns:
        None where the fitting part excludes those parameters.
    """
    data, model, theta, draws = scorer.data, side.model, side.theta, side.draws
    some = draws[:: max(1, len(draws) // LANES)][:LANES]
    nearest = np.argsort(sum_of_squares(held.target - held.simulate(model, some)))[:_STARTS]
    both = fit(_together(data, held), model, np.vstack([theta, some[nearest]])).theta
    if not as_likely(scorer, model, theta, both):
        return None
    return rms(held.target - held.simulate(model, both)[0])


def as_likely(scorer: Scorer, model: Model, theta: Array, other: Array) -> bool:
    """Whether the fitting part allows parameters `other` (p,) beside the best, `theta` (p,).

    It excludes them where they cost more than the 95 % region of a normal posterior, and more than
    twice the standard error over the blocks; a prior of the data counts.
    """
    data, rows = scorer.data, np.stack([theta, other])
    before, after = scorer.whiten(data.target - data.simulate(model, rows))
    lost = _per_block(after**2 - before**2, scorer.blocks)
    most = 0.5 * float(scipy.stats.chi2.ppf(0.95, len(theta)))
    cost = lost.sum()
    if data.prior is not None:
        best, there = data.prior.log_density(rows)
        cost += best - there
    return bool(cost <= max(most, _SURE * standard_error(lost)))


def _per_block(squares: Array, blocks: Sequence[slice]) -> Array:
    return np.array([0.5 * squares[block].sum() for block in blocks])


def _together(a: Data, b: Data) -> Data:
    return Data(
        (*a.records, *b.records),
        (*a.masks, *b.masks),
        (*a.initials, *b.initials),
        (*a.recorded, *b.recorded),
        (*a.origins, *b.origins),
        a.prior,
        steps=(*a.steps, *b.steps),
        each=b.each,
    )
