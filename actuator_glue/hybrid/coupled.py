"""The part of a numerical substructure that the actuator sees."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy

from actuator_glue.hybrid.partition import Partition
from actuator_glue.records import Array

# Of the largest of its kind: what rounding leaves of a coupling that is none.
_NOTHING = 1e-9
# Squares of natural frequencies that count as equal, relative to themselves and to the largest.
_EQUAL, _ROUNDING = 1e-9, 1e-13


def coupled(partition: Partition) -> Partition:
    """Return the partition without the modes that the interface neither moves nor feels.

    A force at the interface leaves such modes at rest, and they leave the interface at rest: no
    delay of the actuator makes them stable or unstable. Undamped, they are roots on the stability
    limit all the same. What is left is the smallest space that holds the interface's modes and
    into which stiffness and damping lead back (Kalman's minimal realisation; both matrices are
    symmetric, so that what cannot be moved cannot be felt).

    Returns:
        a partition whose first degree of freedom is the interface; the others are combinations of
        the old ones that have a mass of 1 kg each, in which the roots are computed to more digits.
    """
    squares, modes = scipy.linalg.eigh(partition.stiffness, partition.mass)
    near = _EQUAL * np.abs(squares[1:]) + _ROUNDING * np.abs(squares).max()
    # Modes of one frequency are any combinations of them: which is seen is found among all.
    groups = np.split(np.arange(len(squares)), np.flatnonzero(np.diff(squares) > near) + 1)
    damping = modes.T @ partition.damping @ modes
    damping /= np.linalg.norm(damping) or 1.0
    reached, count = modes[partition.interface][:, None], 0
    reached = reached / np.linalg.norm(reached)
    while True:
        seen = scipy.linalg.block_diag(*(_span(reached[rows]) for rows in groups))
        if seen.shape[1] in (count, len(squares)):
            break
        reached, count = np.hstack([seen, damping @ seen]), seen.shape[1]
    basis = modes @ seen
    at = basis[partition.interface]
    turned = basis @ np.linalg.qr(at[:, None], mode='complete')[0]
    turned[:, 0] /= turned[partition.interface, 0]
    mass, damping, stiffness = (
        0.5 * (part + part.T)
        for part in (
            turned.T @ matrix @ turned
            for matrix in (partition.mass, partition.damping, partition.stiffness)
        )
    )
    moved = np.ones(len(squares)) if partition.influence is None else partition.influence
    return replace(
        partition,
        mass=mass,
        damping=damping,
        stiffness=stiffness,
        interface=0,
        influence=np.linalg.solve(mass, turned.T @ partition.mass @ moved),
    )


def _span(vectors: Array) -> Array:
    """Return orthonormal columns that span those of vectors (n, m), rounding left out."""
    left, sizes, _ = np.linalg.svd(vectors, full_matrices=False)
    return np.asarray(left[:, sizes > _NOTHING])
