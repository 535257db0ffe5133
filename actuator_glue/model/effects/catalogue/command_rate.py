"""Rate limit of the controller."""

from __future__ import annotations

from dataclasses import replace

from actuator_glue.model.effects.terms.entry import term
from actuator_glue.model.parameters import Parameter

EFFECT = replace(
    term(
        'command-rate',
        'command: u = limit_rate(u, 1/slowest)',
        (Parameter('slowest', 's/m', 0.0, 1e3, 'one over the fastest command', 0.0),),
        group='saturation',
        signature='odd harmonics above an onset in the velocity of the command',
        source='Jelali & Kroll 2003',
        check=False,
    ),
    meaning='the controller limits how fast its command may change',
    remedy='raise the rate limit of the controller, or command less speed',
)
