"""The ridge that one specimen stiffness k leaves: other parameters that fit as well.

Under one k the response depends on alpha_1 beta_0/(alpha_2 + k) and alpha_3/(alpha_2 + k), not on
the oil's stiffness by itself (forces enter as shares of it). Draws reach along that ridge only as
far as `identifiable.py` lets them: their place on it is that of the fit, and with an oil that is
soft beside its specimen not even their spread shows the ridge. So it is followed until bounds or
the records end it.
"""

from __future__ import annotations

import math

import numpy as np

from actuator_glue.diagnosis.posterior.identifiable import Straight, coordinates
from actuator_glue.diagnosis.posterior.likelihood import as_likely
from actuator_glue.diagnosis.score.scorer import Scorer
from actuator_glue.inference.least_squares.free_run import Model
from actuator_glue.inference.least_squares.space import Space
from actuator_glue.model.identifiable import EDGE
from actuator_glue.records import Array

_OIL = 2  # column of alpha_2
_STEPS = 20  # each by a factor of e^2 at least: farther than any bounds are apart
_LEAST = 0.1  # length of a step, as a logarithm: a shorter one is stopped by a bound


def left_open(space: Space, model: Model, scorer: Scorer, theta: Array) -> Array:
    """Return parameters (m, p) along the ridge that the records do not exclude.

    Args:
        space: the working coordinates of all records.
        model: whose parameters they are.
        scorer: the fitting part, and whitening filters of its noise.
        theta: the best parameters (p,), returned alone where several stiffnesses leave no ridge.
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
