"""Integral action of the controller."""

from __future__ import annotations

from dataclasses import replace

from actuator_glue.model.effects.terms.entry import term
from actuator_glue.model.parameters import Parameter

EFFECT = replace(
    term(
        'integral-action',
        'valve: e = e + integral_rate*integral(e)',
        (Parameter('integral_rate', '1/s', 0.0, 20.0, 'integral over proportional gain', 0.0),),
        group='integral',
        signature='linear; no static error, overshoot at low frequency; if weak, as a gain',
        source='Jelali & Kroll 2003 (PI control)',
        check=False,
    ),
    meaning='the controller has an integral part that Eq. (2) lacks',
    remedy='read its gain from the controller; switch it off or declare it with --effect',
)
