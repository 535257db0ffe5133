"""Low-pass in front of the controller."""

from __future__ import annotations

from dataclasses import replace

from actuator_glue.model.effects.terms.entry import term
from actuator_glue.model.parameters import Parameter

EFFECT = replace(
    term(
        'command-lag',
        'command: u = lag(u, command_lag)',
        (Parameter('command_lag', 's', 0.0, 0.05, 'time constant of the low-pass', 0.0),),
        group='lag',
        signature='linear; as a delay with a slight roll-off',
        source='Horiuchi et al. 1999',
        searched=False,  # in a linear loop it equals a sensor's lag, which is searched
        check=False,
    ),
    meaning='a filter smooths the command before the controller sees it',
    remedy='look for a filter in the command path; take it out or record the command behind it',
)
