"""Whether parameters that the fitting part does not exclude explain the held-out part, too.

Along a ridge of hundreds of per cent nothing is linear: to first order (simulation_spread.py), a
machine tested under one stiffness only is another one under the next. So both parts are refitted
together, and the cost of that in the fitting part is checked.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from actuator_glue.diagnosis.posterior.answer_posterior import Side
from actuator_glue.diagnosis.posterior.likelihood import as_likely
from actuator_glue.diagnosis.score.scorer import Scorer
from actuator_glue.diagnosis.verdict.held_out import HeldOutError
from actuator_glue.diagnosis.verdict.rules import misses, takes_nothing
from actuator_glue.inference.least_squares.data import LANES, Data
from actuator_glue.inference.least_squares.fit import fit, rms
from actuator_glue.inference.least_squares.space import sum_of_squares

_STARTS = 3  # draws that are nearest to the held-out part, beside the best fit
_TOLERANCE = 1e-4  # of the squared error: far below what matters of it


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
    starts = np.vstack([theta, some[nearest]])
    both = fit(_together(data, held), model, starts, tolerance=_TOLERANCE).theta
    if not as_likely(scorer, model, theta, both):
        return None
    return rms(held.target - held.simulate(model, both)[0])


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
