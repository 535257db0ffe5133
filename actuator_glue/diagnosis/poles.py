"""Poles that may have changed places: each order is a minimum, of a refit and of a posterior.

To the records a fast valve with a slow filter behind it is nearly a slow valve with a fast filter:
under one stiffness to the last digit, under two a second minimum, a dozen nats behind the first,
with other sizes.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from actuator_glue.model.effects import Effect
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array

# What adds a pole may change places with the valve's, which a valve that is slower or quicker by
# these factors, of the same bandwidth, leads to.
_GROUPS: Final = ('lag', 'gain', 'inertia')
_VALVES: Final = (1.0, 0.6, 1.6, 0.4, 2.5)
# A lag of first order in series with the loop: its pole and the loop's are exchanged exactly.
_IN_SERIES: Final = ('sensor-lag', 'command-lag')


def may_change(added: Effect) -> bool:
    """Return whether an effect's pole may stand for one of the valve's."""
    return added.group in _GROUPS


def starts(
    structure: Structure, added: Effect, theta: Array, stiffness: frozenset[float]
) -> Array:
    """Return where refits of a structure with other orders of its poles begin, (s, p).

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
    """Return parameters (m, p) with the pole of an effect in series exchanged with the loop's.

    None for other effects, nor where the loop's poles oscillate.

    Args:
        structure: with p parameters.
        name: of one of its effects.
        theta: parameters (p,).
        stiffness: of the specimen in the records [N/m]; under each the exchange is another one.
    """
    if name not in _IN_SERIES:
        return np.empty((0, len(theta)))
    column = structure.columns(name).start
    rows = [row for k in sorted(stiffness) for row in _exchanged(theta, column, k)]
    return np.reshape(rows, (-1, len(theta)))


def _exchanged(theta: Array, column: int, stiffness: float) -> list[Array]:
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
