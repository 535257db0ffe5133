"""Second time constant of the valve."""

from __future__ import annotations

from actuator_glue.jit import njit
from actuator_glue.model.effects import linear_step
from actuator_glue.model.effects.effect import Effect
from actuator_glue.model.effects.stage import Stage
from actuator_glue.model.parameters import Parameter

EFFECT = Effect(
    name='valve-lag',
    place='valve',
    equation="T q'' + q' + beta_1 q = alpha_1 beta_0 (u_c - x)",
    parameters=(Parameter('valve_lag', 's', 0.0, 0.02, 'second time constant of the valve', 0.0),),
    group='lag',
    signature='linear; residual grows with the square of frequency',
    source='Merritt 1967; Jelali & Kroll 2003',
    meaning='the servo-valve is slower than Eq. (2) lets it be',
    remedy='nothing, if it is rated so; else check pilot pressure and filters of the valve',
    starts=lambda s: ((0.0005,), (0.002,), (0.006,)),
    exact=linear_step.VALVE,
    stage=Stage(adds={'valve_lag': njit(lambda p: p.valve_lag)}),
)
