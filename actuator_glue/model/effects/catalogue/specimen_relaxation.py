"""Relaxation of a viscoelastic specimen: stiffer in fast motion than in slow motion."""

from __future__ import annotations

from dataclasses import replace

from actuator_glue.model.effects.terms.entry import term
from actuator_glue.model.parameters import Parameter

EFFECT = replace(
    term(
        'specimen-relaxation',
        'specimen: f = f + relaxing*k*(x - lag(x, relaxation))',
        (
            Parameter(
                'relaxing', '1', 0.0, 5.0, 'stiffness that relaxes, over the lasting one', 0.0
            ),
            Parameter('relaxation', 's', 2e-3, 3.0, 'time in which it relaxes', 0.1),
        ),
        signature='linear; stiffness and loop area change with frequency',
        source='Christensen 1982 (standard linear solid)',
        check=False,
    ),
    reserved=True,
    meaning='the specimen is viscoelastic: a part of its force relaxes when motion stops',
    remedy='nothing at the actuator: declare it with --effect, or calibrate without it',
)
