"""The loop of a hybrid test as linear systems: substructures, actuator, compensator."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.hybrid.linear_system import System
from actuator_glue.hybrid.partition import Partition
from actuator_glue.model import linear
from actuator_glue.model.effects import CATALOGUE
from actuator_glue.records import Array


class Actuator(NamedTuple):
    """The closed-loop actuator of each draw: x/u without delay, and the delay (m,) [s]."""

    system: System
    delay: Array


def substructures(partition: Partition, specimen: Mapping[str, Array]) -> System:
    """Return L(s) = H_N(s) G_E(s), from force to specimen force, one for each specimen.

    H_N is the receptance of the numerical substructure at the interface, G_E = m_e s^2 + c_e s +
    k_e; D = m_e over the numerical mass at the interface.

    Args:
        partition: the numerical substructure.
        specimen: mass, damping, stiffness, (m,) each.
    """
    n, at = len(partition.mass), partition.interface
    inverse = np.linalg.inv(partition.mass)
    A = np.zeros((2 * n, 2 * n))
    A[:n, n:] = np.eye(n)
    A[n:, :n], A[n:, n:] = -inverse @ partition.stiffness, -inverse @ partition.damping
    B = np.concatenate([np.zeros(n), inverse[:, at]])
    m, c, k = (np.asarray(specimen[name]) for name in ('mass', 'damping', 'stiffness'))
    C = m[:, None] * A[n + at]
    C[:, at] += k
    C[:, n + at] += c
    count = len(m)
    return System(
        np.repeat(A[None], count, 0), np.repeat(B[None], count, 0), C, m * inverse[at, at]
    )


def actuator(
    draws: Array, names: Sequence[str], effects: Sequence[str], stiffness: Array
) -> Actuator:
    """Return Eq. (2a) of each draw under a specimen stiffness, with gain and delay of the command.

    Effects of the sensor do not move the piston and are left out.

    Args:
        draws: parameters, shape (m, p), SI units.
        names: parameter of each column.
        effects: effects of the model beyond Eq. (2).
        stiffness: specimen stiffness of each draw, (m,) [N/m].

    Raises:
        InputError: an effect that this loop does not know, or draws without an Eq. (2a).
    """
    unknown = [e for e in effects if e not in ('gain', 'delay') and CATALOGUE[e].place != 'sensor']
    if unknown:
        raise InputError(
            f'the posterior has {", ".join(unknown)}: the stability of the loop is computed for '
            'Eq. (2) with gain, delay and effects of the sensor; calibrate with these only'
        )
    table = {name: np.asarray(draws)[:, i] for i, name in enumerate(names)}
    base = np.asarray(draws)[:, :4]
    rows = zip(base, stiffness, strict=True)
    n0, d2, d1, d0 = np.array([linear.coefficients(theta, float(k)) for theta, k in rows]).T
    with np.errstate(divide='ignore', invalid='ignore'):
        system = second_order(table.get('gain', 1.0) * n0 / d2, d1 / d2, d0 / d2)
    if not all(np.isfinite(part).all() for part in system):
        raise InputError(
            'a draw has alpha_2 = 0 and its specimen no stiffness: Eq. (2) does not exist there'
        )
    return Actuator(system, np.asarray(table.get('delay', np.zeros(len(base)))))


def second_order(drive: Array, damping: Array, stiffness: Array) -> System:
    """Return b / (s^2 + a1 s + a0), each coefficient of shape (m,)."""
    m = len(drive)
    A = np.zeros((m, 2, 2))
    A[:, 0, 1], A[:, 1, 0], A[:, 1, 1] = 1.0, -stiffness, -damping
    B = np.zeros((m, 2))
    B[:, 1] = drive
    return System(A, B, np.tile([1.0, 0.0], (m, 1)), np.zeros(m))


def inverse_compensator(mean: System, band_hz: float) -> System:
    """Return the inverse of a second-order actuator, band-limited.

    C(s) = (s^2 + a1 s + a0)/b times w^2/(s^2 + sqrt(2) w s + w^2), the Butterworth low-pass at
    `band_hz`.

    Args:
        mean: what `second_order` made, one row.
        band_hz: where the low-pass has -3 dB [Hz].
    """
    w = 2.0 * np.pi * band_hz
    a0, a1, b = -mean.A[0, 1, 0], -mean.A[0, 1, 1], mean.B[0, 1]
    low = second_order(np.array([w**2]), np.array([np.sqrt(2.0) * w]), np.array([w**2]))
    # The states are the filtered command and its rate; its acceleration has feedthrough.
    C = np.array([[a0 - w**2, a1 - np.sqrt(2.0) * w]]) / b
    return low._replace(C=C, D=np.array([w**2 / b]))
