"""Nonlinear effects as a loop meets them: gain and delay at one frequency and one amplitude.

The describing function (Gelb and Vander Velde 1968) of the whole actuator: the fundamental of its
response to a sine. It is simulated, so that any effect has one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from actuator_glue.hybrid.actuator import nonlinear, table_of
from actuator_glue.hybrid.linear_system import Complex
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array, Record

_POINTS = 128  # a period
_SETTLED, _COUNTED = 6, 4  # periods


def describing(structure: Structure, theta: Array, record: Record) -> tuple[Complex, Complex]:
    """Return the fundamentals of motion and actuator force over that of the command, (m,) each.

    Args:
        structure: the model, without effects of the sensor.
        theta: shape (m, p), SI units.
        record: a sine of `_SETTLED` + `_COUNTED` periods from `sine`; its stiffness is used.
    """
    turn = np.exp(-2j * np.pi * np.arange(_COUNTED * _POINTS) / _POINTS)
    asked = record.command[-len(turn) :] @ turn
    moved, force = (
        structure.simulate(theta, record, force=wanted)[:, -len(turn) :] @ turn / asked
        for wanted in (False, True)
    )
    return moved, force


def sine(frequency: float, amplitude: float, stiffness: float) -> Record:
    """Return a test by a sine of a frequency [Hz] and an amplitude [m]."""
    count = (_SETTLED + _COUNTED) * _POINTS
    command = amplitude * np.sin(2.0 * np.pi * np.arange(count) / _POINTS)
    return Record(
        command, np.zeros(count), 1.0 / (_POINTS * frequency), stiffness=stiffness, hold='linear'
    )


def force_ratio(
    draws: Array,
    names: Sequence[str],
    effects: Sequence[str],
    specimen: Mapping[str, float],
    motion: tuple[float, float],
) -> Complex:
    """Return the specimen's force with all effects over that with the linear ones, (m,).

    Args:
        draws: parameters, (m, p), SI units.
        names: parameter of each column.
        effects: effects of the model beyond Eq. (2), without those of the sensor.
        specimen: its mass, damping and stiffness.
        motion: frequency [Hz] and amplitude [m] of the command.
    """
    curved = set(nonlinear(effects))
    k, w = specimen['stiffness'], 2.0 * np.pi * motion[0]
    test = sine(*motion, k)
    found = []
    for kept in (effects, [n for n in effects if n not in curved]):
        structure = Structure(tuple(kept))
        found.append(describing(structure, table_of(draws, names, structure), test))
    (moved, force), (plain, plain_force) = found
    # Mass and damping of the specimen act on the motion; effects add to the force beyond it.
    rigid = k + 1j * w * specimen['damping'] - w**2 * specimen['mass']
    added = force - plain_force * moved / plain
    return np.asarray((rigid * moved + added) / (rigid * plain))
