"""Hysteresis of the valve."""

from __future__ import annotations

from dataclasses import replace

from actuator_glue.model.effects.terms.entry import term
from actuator_glue.model.parameters import Parameter

EFFECT = replace(
    term(
        'valve-hysteresis',
        'valve: e = play(e, valve_play)',
        (Parameter('valve_play', 'm', 0.0, 2e-3, 'play as control error, half width', 0.0),),
        group='lost-motion',
        signature='minor loops: the valve answers a reversal late',
        source='Merritt 1967; Tao & Kokotovic 1996 (play operator)',
        check=False,
    ),
    meaning='the valve answers a reversal late',
    remedy='clean oil and valve; check its torque motor and dither',
)
