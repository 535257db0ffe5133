"""Calibrated actuators as linear systems: Eq. (2) with the linear effects of the model."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.hybrid.linear_system import System
from actuator_glue.model.effects import CATALOGUE, Effect, linear_effects
from actuator_glue.model.effects.linear_step import STATES
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array

# Time constants and masses below these act faster than any loop: their states would only be stiff.
_SHORTEST = 1e-6  # s
_LIGHTEST = 1e-8  # s^2, mass over stiffness of oil and specimen


class Actuator(NamedTuple):
    """The closed-loop actuator of each draw under its specimen's spring.

    Attributes:
        system: piston displacement over command, without delay.
        delay: of the command, less its lead, (m,) [s].
        shown: row that gives the recorded displacement, (n,).
    """

    system: System
    delay: Array
    shown: Array


def nonlinear(effects: Sequence[str]) -> tuple[str, ...]:
    """Return the effects that no linear system has."""
    return tuple(name for name in effects if not CATALOGUE[name].linear)


def inside(effects: Sequence[str]) -> list[str]:
    """Return the effects that the piston's motion has: all but those of the sensor.

    Where the controller closes its loop on the recorded transducer, they move the piston, too; the
    record then stands for its motion.
    """
    heard = 'sensor-feedback' in effects
    return [name for name in effects if heard or CATALOGUE[name].place != 'sensor']


def table_of(draws: Array, names: Sequence[str], structure: Structure) -> Array:
    """Return draws (m, p) with the columns in the order of a structure's parameters."""
    return np.asarray(draws)[:, [list(names).index(name) for name in structure.names]]


def actuator(
    draws: Array, names: Sequence[str], effects: Sequence[str | Effect], stiffness: Array
) -> Actuator:
    """Return each draw's actuator, its linear effects included, all others left out.

    Args:
        draws: parameters, shape (m, p), SI units.
        names: parameter of each column.
        effects: effects of the model beyond Eq. (2).
        stiffness: specimen stiffness of each draw, (m,) [N/m].

    Raises:
        InputError: draws without an Eq. (2a), or without a parameter of the model.
    """
    structure = Structure(effects)
    missing = [name for name in structure.names if name not in names]
    if missing:
        raise InputError(f'draws of {", ".join(names)} are none of {", ".join(missing)}, too')
    values = structure.values(table_of(draws, names, structure))
    oil = values['alpha_2'] + stiffness
    if not (oil > 0.0).all():
        raise InputError(
            'a draw has alpha_2 = 0 and its specimen no stiffness: Eq. (2) does not exist there'
        )
    used = sorted({0, 1} | {s for e in structure.entries for s in e.exact or ()})
    row = np.array([s if s in used else -1 for s in range(STATES)])
    for name, least in (
        ('valve_lag', _SHORTEST),
        ('sensor_lag', _SHORTEST),
        ('damping', _SHORTEST * oil),
        ('mass', _LIGHTEST * oil),
    ):
        if name != 'damping' or 'payload-inertia' not in structure.effects:
            values[name] = np.maximum(values[name], least)
    rows = np.zeros(len(oil), linear_effects.KIND)
    for name in linear_effects.NAMES:
        rows[name] = values[name]
    m, n = len(rows), len(used)
    A, B = np.empty((m, n, n)), np.empty((m, n))
    a, b, f = np.empty((STATES, STATES)), np.empty(STATES), np.empty(STATES)
    for i, (one, k) in enumerate(zip(rows, stiffness, strict=True)):
        linear_effects.system(one, float(k), a, b, row, f)
        A[i], B[i] = a[np.ix_(used, used)], b[used]
    piston, shown = np.zeros((m, n)), np.zeros(n)
    piston[:, 0] = 1.0
    shown[used.index(5) if 5 in used else 0] = 1.0
    return Actuator(System(A, B, piston, np.zeros(m)), values['delay'] - values['lead'], shown)
