"""The ridge that one specimen stiffness k leaves: other parameters that fit as well.

Then the response has alpha_1 beta_0/(alpha_2 + k) and alpha_3/(alpha_2 + k) in it, and of the
oil's stiffness alone nothing (of forces their share of it). Draws reach along that ridge only as
far as `identifiable.py` lets them: where on it they lie is where a fit stood, and with an oil that
is soft beside its specimen not even a spread tells. So it is walked, until bounds or the records
end it.
"""

from __future__ import annotations

import math

import numpy as np

from actuator_glue.diagnosis.held_out_reach import as_likely
from actuator_glue.diagnosis.identifiable import Straight, coordinates
from actuator_glue.diagnosis.score import Scorer
from actuator_glue.inference.least_squares.free_run import Model
from actuator_glue.inference.least_squares.space import Space
from actuator_glue.model.identifiable import EDGE
from actuator_glue.records import Array

_OIL = 2  # column of alpha_2
_STEPS = 20  # each over e^2 at least: more than any bounds are apart
_LEAST = 0.1  # of a step, as a logarithm: bounds end what is shorter


def left_open(space: Space, model: Model, scorer: Scorer, theta: Array) -> Array:
    """Return parameters (m, p) along the ridge that the records do not exclude.

    Args:
        space: the working coordinates of all records.
        model: whose parameters they are.
        scorer: the fitting part, and whitening filters of its noise.
        theta: the best of them (p,), m = 1 where records under several stiffnesses leave no ridge.
    """
    out = [theta]
    for end in (-EDGE, EDGE):
        here = theta
        for _ in range(_STEPS):
            around = coordinates(space, model, scorer.data, space.z(here[None])[0])
            if not isinstance(around, Straight):
                break
            phi = around.forward(here[None])
            phi[:, _OIL] = end
            there, log_prior = around.inverse(phi)
            ended = not np.isfinite(log_prior[0])
            if ended or abs(math.log(there[0, _OIL] / here[_OIL])) < _LEAST:
                break
            if not as_likely(scorer, model, theta, there[0]):
                break
            here = there[0]
            out.append(here)
    return np.stack(out)
