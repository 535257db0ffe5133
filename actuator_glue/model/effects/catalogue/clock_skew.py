"""Two clocks of different rate."""

from __future__ import annotations

from collections.abc import Mapping

from actuator_glue.jit import njit
from actuator_glue.model.effects import layout as r
from actuator_glue.model.effects.effect import Effect
from actuator_glue.model.effects.stage import Stage
from actuator_glue.model.parameters import Parameter
from actuator_glue.records import Array


def _behind(values: Mapping[str, Array], origin: float) -> dict[str, Array]:
    return {'delay': values['delay'] + values['clock_skew'] * origin}


EFFECT = Effect(
    name='clock-skew',
    place='sensor',
    equation='u_c(t) = u(t - eps t): the record lags more and more (eps > 0) behind the command',
    parameters=(
        Parameter('clock_skew', '1', -1e-3, 1e-3, 'relative rate error of the two clocks', 0.0),
    ),
    group='skew',
    signature='lag grows with time',
    source='Mills 1991 (frequency error of clocks)',
    meaning='controller and recorder count time by clocks of different rate',
    remedy='record both channels with one clock, or correct the rate of the slower one',
    starts=lambda s: ((5e-5,), (-5e-5,), (3e-4,), (-3e-4,)),
    onset=lambda record: _behind,
    stage=Stage(adds={'skew': njit(lambda p: p.clock_skew)}, shared=(r.ON_LAG,)),
)
