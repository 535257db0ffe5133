"""Effects in the servo-valve: error u_c - x to spool flow."""

from __future__ import annotations

from actuator_glue.model.effects import lti
from actuator_glue.model.effects.effect import Effect
from actuator_glue.model.parameters import Parameter

LAG = Effect(
    name='valve-lag',
    place='valve',
    equation="T q'' + q' + beta_1 q = alpha_1 beta_0 (u_c - x)",
    parameters=(Parameter('valve_lag', 's', 0.0, 0.02, 'second time constant of the valve', 0.0),),
    group='lag',
    signature='linear; residual grows with the square of frequency',
    source='Merritt 1967; Jelali & Kroll 2003',
    starts=lambda s: ((0.0005,), (0.002,), (0.006,)),
    exact=lti.VALVE,
)

DEADBAND = Effect(
    name='valve-deadband',
    place='valve',
    equation='e = D(u_c - x, w), D(e, w) = sign(e) max(|e| - w, 0)',
    parameters=(
        Parameter('deadband', 'm', 0.0, 2e-3, 'overlap as control error, half width', 0.0),
    ),
    group='lost-motion',
    signature='odd harmonics; flat where the velocity is small; relative size falls as 1/A',
    source='Merritt 1967; Tao & Kokotovic 1996',
    starts=lambda s: ((0.005 * s.stroke,), (0.02 * s.stroke,), (0.06 * s.stroke,)),
)

NULL = Effect(
    name='valve-null',
    place='valve',
    equation='e = u_c - x + e_0',
    parameters=(
        Parameter('null_offset', 'm', -2e-3, 2e-3, 'null bias of the valve as control error', 0.0),
    ),
    group='offset',
    signature='constant offset; with k > 0 and leakage slightly smaller than without',
    source='Merritt 1967',
    starts=lambda s: ((0.02 * s.stroke,), (-0.02 * s.stroke,)),
)

EFFECTS = (LAG, DEADBAND, NULL)
