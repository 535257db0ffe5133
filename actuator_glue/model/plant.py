"""Simulated actuators that run block by block; their output does not depend on the block size.

Eq. (2) with any effects is `model.stream.Stream`; here are what it has in common with others,
linear plants of any order, and what sensors add.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from actuator_glue.errors import InputError
from actuator_glue.jit import njit
from actuator_glue.model.sensor import Sensor, SensorSpec
from actuator_glue.records import MAX_DISPLACEMENT, Array, Hold, numbers


class Plant(Protocol):
    """An actuator with its specimen, one sample period per command sample."""

    @property
    def period(self) -> float:
        """Sample period [s]."""

    def reset(self) -> None:
        """Return to the state before the first sample."""

    def step(self, command: ArrayLike) -> tuple[Array, Array]:
        """Run through a block; return displacement [m] and force [N], each of shape (n,)."""


def command_block(command: ArrayLike) -> Array:
    """Return a block of commands, shape (n,) [m].

    Raises:
        InputError: not one row of finite samples, or beyond any actuator's stroke.
    """
    if isinstance(command, np.ma.MaskedArray):
        command = numbers(command)
    block = np.ascontiguousarray(command, dtype=np.float64)
    if block.ndim != 1:
        raise InputError(f'command block has shape {block.shape}; one row of samples is needed')
    if not np.isfinite(block).all():
        raise InputError(f'command is not finite at sample {int(np.isfinite(block).argmin())}')
    if block.size and np.abs(block).max() > MAX_DISPLACEMENT:
        raise InputError(
            f'command reaches {np.abs(block).max():g} m, beyond {MAX_DISPLACEMENT:g} m; '
            'commands are in m'
        )
    return block


# Strict order of operations: the result must not depend on how a command is cut into blocks.
@njit(fastmath=False)
def _state_space(
    A: Array, B0: Array, B1: Array, C: Array, x: Array, previous: Array, u: Array, out: Array
) -> None:
    """Step x[n+1] = A x[n] + B0 u[n] + B1 u[n+1], out[n] = C x[n], through a block.

    `previous` is the last command of the block before, empty (NaN) at the first sample, which
    shows the initial state.
    """
    size, new = len(x), np.empty(len(x))
    for n in range(len(u)):
        if not np.isnan(previous[0]):
            for i in range(size):
                total = B0[i] * previous[0] + B1[i] * u[n]
                for j in range(size):
                    total += A[i, j] * x[j]
                new[i] = total
            x[:] = new
        previous[0] = u[n]
        for i in range(len(C)):
            total = 0.0
            for j in range(size):
                total += C[i, j] * x[j]
            out[i, n] = total


class StateSpacePlant:
    """Any linear plant dx/dt = A x + B u with displacement and force C x, discretised exactly.

    Args:
        A: shape (s, s) [1/s].
        B: shape (s,) for a command in m.
        C: rows that give displacement [m] and force [N], shape (2, s).
        period: sample period [s].
        hold: how the command runs between its samples.
        stroke: commands are limited to -stroke..stroke, as a controller does [m].
    """

    def __init__(
        self,
        A: ArrayLike,
        B: ArrayLike,
        C: ArrayLike,
        period: float,
        hold: Hold = 'zoh',
        stroke: float = MAX_DISPLACEMENT,
    ) -> None:
        from scipy.linalg import expm, matrix_balance

        a, b = np.asarray(A, dtype=np.float64), np.asarray(B, dtype=np.float64)
        size = len(a)
        # Augmented with a held command and its slope (van Loan); balanced, since displacement
        # and force differ by many orders of magnitude.
        big = np.zeros((size + 2, size + 2))
        big[:size, :size], big[:size, size], big[size, size + 1] = a, b, 1.0
        balanced, scaling = matrix_balance(big * period, permute=False)
        phi = scaling @ expm(balanced) @ np.linalg.inv(scaling)
        held, slope = phi[:size, size], phi[:size, size + 1] / period
        self.period = period
        self.stroke = stroke
        self._A = np.ascontiguousarray(phi[:size, :size])
        self._B1 = slope if hold == 'linear' else np.zeros(size)
        self._B0 = held - self._B1
        self._C = np.ascontiguousarray(C, dtype=np.float64)
        self.reset()

    def reset(self) -> None:
        """Return to rest."""
        self._x = np.zeros(len(self._A))
        self._previous = np.array([np.nan])

    def step(self, command: ArrayLike) -> tuple[Array, Array]:
        """Run through a block; return displacement [m] and force [N], each of shape (n,).

        Raises:
            InputError: unusable command.
        """
        u = np.clip(command_block(command), -self.stroke, self.stroke)
        out = np.empty((len(self._C), len(u)))
        _state_space(self._A, self._B0, self._B1, self._C, self._x, self._previous, u, out)
        return out[0], out[1]


class MeasuredPlant:
    """A plant seen through its displacement and force sensors.

    Args:
        plant: what moves.
        displacement: displacement sensor [m].
        force: force sensor [N].
        seed: seeds both sensors' noise, each with a stream of its own.
    """

    def __init__(
        self,
        plant: Plant,
        displacement: SensorSpec | None = None,
        force: SensorSpec | None = None,
        seed: int = 0,
    ) -> None:
        self.plant = plant
        of_x, of_f = np.random.SeedSequence(seed).spawn(2)
        self.displacement = Sensor(displacement or SensorSpec(), of_x)
        self.force = Sensor(force or SensorSpec(), of_f)

    @property
    def period(self) -> float:
        """Sample period [s]."""
        return self.plant.period

    def reset(self) -> None:
        """Return plant and noise streams to the state before the first sample."""
        self.plant.reset()
        self.displacement.reset()
        self.force.reset()

    def step(self, command: ArrayLike) -> tuple[Array, Array]:
        """Run through a block; return measured displacement [m] and force [N], shape (n,).

        Raises:
            InputError: unusable command.
        """
        x, f = self.plant.step(command)
        return self.displacement.measure(x), self.force.measure(f)
