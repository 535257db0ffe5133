"""Poles that may have changed places: each order is a minimum, of a refit and of a posterior.

To the records a fast valve with a slow filter behind it is nearly a slow valve with a fast filter:
under one stiffness to the last digit; under two it is a second minimum with other sizes, a dozen
nats behind the first.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from actuator_glue.model.effects import Effect
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array

# Groups of effects whose pole may change places with the valve's; starts for that are valves
# slower or quicker by these factors, of the same bandwidth.
_GROUPS: Final = ('lag', 'gain', 'inertia')
_VALVES: Final = (1.0, 0.6, 1.6, 0.4, 2.5)
# A lag of first order in series with the loop: its pole and the loop's are exchanged exactly.
_IN_SERIES: Final = ('sensor-lag', 'command-lag')
# Forces on the piston beside the specimen's spring: the loop opened at the valve's error then has
# further poles, of which each real one may be the valve's, exactly.
_ON_PISTON: Final = ('viscous-damping', 'payload-inertia')
_LEAST: Final = 1e-9  # kg or N s/m: with less, the added poles are too large to compute


def may_change(added: Effect) -> bool:
    """Return whether an effect's pole may stand for one of the valve's."""
    return added.group in _GROUPS


def starts(
    structure: Structure, added: Effect, theta: Array, stiffness: frozenset[float]
) -> Array:
    """Return starting parameters (s, p) for refits of a structure with its poles reordered.

    Args:
        structure: with p parameters.
        added: the effect whose pole may stand for one of the valve's.
        theta: parameters of one minimum (p,), the first that is returned.
        stiffness: of the specimen in the records [N/m].
    """
    found = np.tile(theta, (len(_VALVES), 1))
    found[:, :2] *= np.array(_VALVES)[:, None]
    return np.concatenate([found, exchanged(structure, added.name, theta, stiffness)])


def exchanged(structure: Structure, name: str, theta: Array, stiffness: frozenset[float]) -> Array:
    """Return parameters (m, p) with an effect's pole exchanged for another, the response alike.

    A lag in series is exchanged for poles of the loop, where these do not oscillate; a force on
    the piston for the valve's. None for other effects.

    Args:
        structure: with p parameters.
        name: of one of its effects.
        theta: parameters (p,).
        stiffness: of the specimen in the records [N/m]; each gives another exchange.
    """
    rows: list[Array] = []
    for k in sorted(stiffness):
        if name in _IN_SERIES:
            rows += _in_series(theta, structure.columns(name).start, k)
        elif name in _ON_PISTON:
            rows += _on_piston(theta, structure.columns(name), k)
    return np.reshape(rows, (-1, len(theta)))


def _on_piston(theta: Array, columns: slice, stiffness: float) -> list[Array]:
    """Give the valve each other real pole of the loop opened at its error, under a stiffness.

    With the force m s^2 + c s + k on the piston that loop has the poles of (s + beta_1) times
    (s + alpha_3) (m s^2 + c s + k) + alpha_2 s: whichever is the valve's, the others are those of
    an actuator with another leakage, oil column and, where there is a mass, damping.
    """
    heavy = columns.stop - columns.start > 1
    mass = float(theta[columns.start]) if heavy else 0.0
    damping = float(theta[columns.stop - 1]) * (mass if heavy else 1.0)
    lead = mass if heavy else damping
    if not (stiffness > 0.0 and lead > _LEAST):
        return []
    force = np.array([mass, damping, stiffness])[0 if heavy else 1 :]
    oil = np.polymul([1.0, theta[3]], force)
    oil[-2] += theta[2]
    opened = np.concatenate([[-theta[0]], np.roots(oil)])
    out = []
    for i, root in enumerate(opened[1:], 1):
        if root.imag != 0.0 or not root.real < 0.0:
            continue
        row, rest = theta.copy(), lead * np.poly(np.delete(opened, i)).real
        row[0], row[3] = -root.real, rest[-1] / stiffness
        if heavy:
            row[columns.stop - 1] = rest[1] / mass - row[3]
            damping = mass * float(row[columns.stop - 1])
        row[2] = rest[-2] - row[3] * damping - stiffness
        if min(row[2], damping) > 0.0:
            out.append(row)
    return out


def _in_series(theta: Array, column: int, stiffness: float) -> list[Array]:
    """Exchange the pole of a lag with each real one of the loop under a stiffness.

    Eq. (2a) with d2 = k + alpha_2, c = alpha_3 k/d2 and n = alpha_1 beta_0/d2 has the denominator
    s^2 + (beta_1 + c) s + beta_1 c + n and the static gain n/(beta_1 c + n), which stays.
    """
    beta_1, into, alpha_2, alpha_3 = theta[:4]
    oil = stiffness + alpha_2
    leak, lag = alpha_3 * stiffness / oil, theta[column]
    product = beta_1 * leak + into / oil
    poles = np.roots([1.0, beta_1 + leak, product])
    if np.iscomplexobj(poles) or not lag > 0.0:
        return []
    out = []
    for gone, stays in (-poles, -poles[::-1]):
        row = theta.copy()
        total, leaking = stays + 1.0 / lag, beta_1 * leak * stays / (lag * product)
        root = total**2 - 4.0 * leaking
        if root >= 0.0:
            row[0] = 0.5 * (total + np.sqrt(root))
            row[1] = (stays / lag - leaking) * oil
            row[3] *= leaking / (row[0] * leak) if leak > 0.0 else 1.0
            row[column] = 1.0 / gone
            out.append(row)
    return out
