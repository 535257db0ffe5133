"""The alarm: whether the residual of Eq. (2) shows that it is not enough, and the numbers."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from actuator_glue.json_value import JsonObject


@dataclass(frozen=True, slots=True)
class Alarm(JsonObject):
    """Why (or why not) the model of Eq. (2) is not enough.

    Attributes:
        raised: significant and material.
        structured: rms of the part of the residual that is a function of the command [m].
        threshold: materiality threshold for it [m].
        noise: rms of the rest [m].
        p_value: of the structure under the fitted base model with its own coloured noise.
        false_alarms: probability of any addition on a healthy machine, as asked for.
        nats: evidence that an addition must have at this level.
        tests: further statistics shown to people (whiteness, harmonics, drift, ...).
    """

    raised: bool
    structured: float
    threshold: float
    noise: float
    p_value: float
    false_alarms: float = math.nan
    nats: float = math.nan
    tests: dict[str, float] = field(default_factory=dict)
