"""The substructures of a hybrid test as linear systems."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from actuator_glue.hybrid.coupled import coupled
from actuator_glue.hybrid.linear_system import System
from actuator_glue.hybrid.partition import Partition
from actuator_glue.records import Array


def substructures(partition: Partition, specimen: Mapping[str, Array]) -> System:
    """Return L(s) = H_N(s) G_E(s), from force to specimen force, one for each specimen.

    H_N is the receptance of the numerical substructure at the interface, G_E = m_e s^2 + c_e s +
    k_e; D = m_e over the numerical mass at the interface. Only modes that the interface moves.

    Args:
        partition: the numerical substructure.
        specimen: mass, damping, stiffness, (m,) each.
    """
    partition = coupled(partition)
    n, at = len(partition.mass), partition.interface
    inverse = inverted(partition.mass)
    A = states(inverse, partition.damping, partition.stiffness)
    B = np.concatenate([np.zeros(n), inverse[:, at]])
    m, c, k = (np.asarray(specimen[name]) for name in ('mass', 'damping', 'stiffness'))
    C = m[:, None] * A[n + at]
    C[:, at] += k
    C[:, n + at] += c
    count = len(m)
    return System(
        np.repeat(A[None], count, 0), np.repeat(B[None], count, 0), C, m * inverse[at, at]
    )


def inverted(matrix: Array) -> Array:
    """Return the inverse of a mass matrix."""
    return np.asarray(np.linalg.inv(matrix), dtype=np.float64)


def states(inverse: Array, damping: Array, stiffness: Array) -> Array:
    """Return the state matrix (2 n, 2 n) of M x'' + C x' + K x = 0, given the inverse of M."""
    n = len(inverse)
    A = np.zeros((2 * n, 2 * n))
    A[:n, n:] = np.eye(n)
    A[n:, :n], A[n:, n:] = -inverse @ stiffness, -inverse @ damping
    return A
