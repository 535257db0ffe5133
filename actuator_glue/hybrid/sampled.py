"""The loop of a hybrid test as its computer runs it: one step a sample, everything held between.

At a sample the force is measured, the target is that of the numerical substructure's state, the
command is made of it and goes out; force and ground motion are held until the next sample, and so
is the command.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import scipy

from actuator_glue.hybrid.actuator import Actuator
from actuator_glue.hybrid.linear_system import held
from actuator_glue.hybrid.loop import inverted, states
from actuator_glue.hybrid.partition import Partition
from actuator_glue.records import Array

_AT_ONCE = 64  # draws whose matrices are in memory together


class Numerical(NamedTuple):
    """The numerical substructure over one sample, s = 2 n states: displacements, velocities.

    Attributes:
        step: transition matrix, (s, s).
        force: what a force that pulls the interface back adds, (s,).
        ground: what a ground acceleration adds, (s,).
        acceleration: row that gives the interface's acceleration from the states, the force and
            the ground acceleration, (s + 2,).
        interface: degree of freedom that the actuator imposes.
    """

    step: Array
    force: Array
    ground: Array
    acceleration: Array
    interface: int


class Plants(NamedTuple):
    """Linear actuators over one sample, many side by side, with their specimens.

    Attributes:
        step: transition matrices, (m, p, p); delayed commands are states.
        command: what a command adds, (m, p).
        speed: row of the piston's velocity, (m, p); its displacement is the first state.
        shown: row of the recorded displacement, (p,).
        specimen: stiffness, damping, mass, (3, m).
    """

    step: Array
    command: Array
    speed: Array
    shown: Array
    specimen: Array


def numerical(partition: Partition) -> Numerical:
    """Return the numerical substructure over one sample; the ground moves the whole structure."""
    n = len(partition.mass)
    inverse = inverted(partition.mass)
    pull = np.zeros(n)
    pull[partition.interface] = 1.0
    A = states(inverse, partition.damping, partition.stiffness)
    inputs = np.zeros((2 * n, 2))
    inputs[n:, 0], inputs[n:, 1] = -inverse @ pull, -inverse @ partition.load
    step, held_inputs = _over(A, inputs, partition.period)
    at = n + partition.interface
    return Numerical(
        step,
        np.ascontiguousarray(held_inputs[:, 0]),
        np.ascontiguousarray(held_inputs[:, 1]),
        np.concatenate([A[at], inputs[at]]),
        partition.interface,
    )


def reference(partition: Partition, specimen: Mapping[str, Array]) -> tuple[Array, Array]:
    """Return transition matrices (m, s, s) and what the ground adds (m, s), whole structures.

    With each specimen in place and no actuator between: what a perfect test would show.
    """
    n, at = len(partition.mass), partition.interface
    rows = np.stack([specimen[name] for name in ('mass', 'damping', 'stiffness')], axis=1)
    unique, which = np.unique(rows, axis=0, return_inverse=True)
    steps, grounds = np.empty((len(unique), 2 * n, 2 * n)), np.empty((len(unique), 2 * n))
    for i, parts in enumerate(unique):
        matrices = []
        for matrix, part in zip(
            (partition.mass, partition.damping, partition.stiffness), parts, strict=True
        ):
            whole = matrix.copy()
            whole[at, at] += part
            matrices.append(whole)
        inverse = inverted(matrices[0])
        inputs = np.zeros((2 * n, 1))
        inputs[n:, 0] = -inverse @ partition.load
        A = states(inverse, matrices[1], matrices[2])
        steps[i], ground = _over(A, inputs, partition.period)
        grounds[i] = ground[:, 0]
    which = which.reshape(-1)
    return steps[which], grounds[which]


def plants(actuators: Actuator, specimen: Mapping[str, Array], partition: Partition) -> Plants:
    """Return linear actuators over one sample, with their delay and that of the computation."""
    delay = actuators.delay + partition.computation_delay
    discrete = held(actuators.system, partition.period, delay)
    m, p = discrete.B.shape
    n = actuators.system.A.shape[1]
    speed, shown = np.zeros((m, p)), np.zeros(p)
    speed[:, :n] = (actuators.system.C[:, None] @ actuators.system.A)[:, 0]
    shown[:n] = actuators.shown
    parts = np.array([specimen[name] for name in ('stiffness', 'damping', 'mass')])
    return Plants(discrete.A, discrete.B, speed, shown, parts)


def growth(structure: Numerical, actuators: Plants, coefficients: Array, period: float) -> Array:
    """Return the real part of the rightmost characteristic root of each sampled loop, (m,) [1/s].

    ln |z| / T of the largest root z: positive where the test is unstable.

    Args:
        structure: numerical substructure.
        actuators: m of them.
        coefficients: of the compensator, (3,).
        period: sample period T [s].
    """
    s, (m, p) = len(structure.step), actuators.command.shape
    k, c, mass = actuators.specimen
    # States: structure, actuator, and its velocity one sample ago for the specimen's inertia.
    force = np.zeros((m, p + 1))
    force[:, :p] = (c + mass / period)[:, None] * actuators.speed
    force[:, 0] += k
    force[:, p] = -mass / period
    at = structure.interface
    target = coefficients[2] * structure.acceleration[:s]
    target[at] += coefficients[0]
    target[s // 2 + at] += coefficients[1]
    through = coefficients[2] * structure.acceleration[s]
    out = np.empty(m)
    for first in range(0, m, _AT_ONCE):
        part = slice(first, min(first + _AT_ONCE, m))
        loop = np.zeros((part.stop - first, s + p + 1, s + p + 1))
        loop[:, :s, :s] = structure.step
        loop[:, :s, s:] = structure.force[:, None] * force[part, None]
        into = actuators.command[part, :, None]
        loop[:, s : s + p, :s] = into * target
        loop[:, s : s + p, s:] = through * into * force[part, None]
        loop[:, s : s + p, s : s + p] += actuators.step[part]
        loop[:, s + p, s : s + p] = actuators.speed[part]
        radius = np.abs(np.linalg.eigvals(loop)).max(axis=1)
        out[part] = np.log(radius) / period
    return out


def _over(A: Array, inputs: Array, period: float) -> tuple[Array, Array]:
    """Return exp(A T) and its integral times held inputs (s, r)."""
    s, r = inputs.shape
    block = np.zeros((s + r, s + r))
    block[:s, :s], block[:s, s:] = A, inputs
    out = np.asarray(scipy.linalg.expm(block * period))
    return np.ascontiguousarray(out[:s, :s]), out[:s, s:]
