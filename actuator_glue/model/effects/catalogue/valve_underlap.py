"""Underlap of the spool: twice the flow while both of its edges are open."""

from __future__ import annotations

from dataclasses import replace

from actuator_glue.model.effects.terms.entry import term
from actuator_glue.model.parameters import Parameter

EFFECT = replace(
    term(
        'valve-underlap',
        'valve: e = e + clip(e, -underlap, underlap)',
        (Parameter('underlap', 'm', 0.0, 2e-3, 'underlap as control error, half width', 0.0),),
        signature='odd harmonics; faster where the velocity is small',
        source='Merritt 1967',
        check=False,
    ),
    reserved=True,
    meaning='the spool is narrower than its ports: near its centre the flow gain doubles',
    remedy='have the edges of the spool checked for wear; a matched spool and sleeve',
)
