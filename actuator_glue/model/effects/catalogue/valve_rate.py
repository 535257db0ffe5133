"""Slew limit of the spool."""

from __future__ import annotations

from dataclasses import replace

from actuator_glue.model.effects.terms.entry import term
from actuator_glue.model.parameters import Parameter

# The control error at which the spool moves as fast as it can, from
# dq/dt = alpha_1 beta_0 e - beta_1 q.
_LIMIT = '(beta_1*q {} alpha_2/slew)/alpha_1_beta_0'

EFFECT = replace(
    term(
        'valve-rate',
        f'valve: e = clip(e, {_LIMIT.format("-")}, {_LIMIT.format("+")})',
        (
            Parameter(
                'slew',
                's^2/m',
                0.0,
                10.0,
                'one over the acceleration of the free piston while the spool slews',
                0.0,
            ),
        ),
        group='saturation',
        signature='odd harmonics above an onset in acceleration; more lag at larger amplitudes',
        source='Merritt 1967; Jelali & Kroll 2003',
        check=False,
    ),
    reserved=True,
    meaning='the spool cannot move faster: its pilot stage gives no more flow',
    remedy='command smaller or slower motion, raise the pilot pressure, or take a faster valve',
)
