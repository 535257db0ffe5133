"""A model structure stepped block by block: the actuator of the simulator."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from actuator_glue.errors import InputError
from actuator_glue.model.effects import kernel, layout, linear_effects, linear_step, run
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array, Hold, check_stiffness


class Stream:
    """One actuator with any effects, from rest, fed with blocks of command samples.

    Any split of a command into blocks gives the same output, and (without noise) the output of
    `Structure.simulate`.

    Args:
        structure: Eq. (2) and the effects that act.
        theta: parameters, shape (p,).
        stiffness: specimen stiffness k [N/m].
        period: sample period [s].
        hold: how the command runs between its samples.
        rng: source of timing jitter and sensor noise; needed where either is on.
        noise_stddev: standard deviation of white sensor noise [m].

    Raises:
        InputError: wrong shape or non-finite theta, stiffness or period that cannot be used, a
            clock skew that would need future commands, noise or jitter without rng.
    """

    def __init__(
        self,
        structure: Structure,
        theta: ArrayLike,
        *,
        stiffness: float,
        period: float,
        hold: Hold = 'zoh',
        rng: np.random.Generator | None = None,
        noise_stddev: float = 0.0,
    ) -> None:
        self.structure = structure
        self.theta = np.array(theta, dtype=np.float64)
        if self.theta.shape != (len(structure.parameters),):
            raise InputError(
                f'theta has shape {self.theta.shape}; {structure!r} takes '
                f'({len(structure.parameters)},): {", ".join(structure.names)}'
            )
        if not np.isfinite(self.theta).all():
            raise InputError(f'theta {self.theta} is not finite')
        if not (math.isfinite(period) and 1e-6 <= period <= 10.0):
            raise InputError(f'sample period {period:g} s is outside [1e-6, 10] s')
        self.stiffness = check_stiffness(stiffness)
        self.period = float(period)
        self.hold = hold
        self._values = structure.values(self.theta[np.newaxis])
        self._late = float(self._values['delay'][0] - self._values['lead'][0])
        if self._values['clock_skew'][0] < 0.0 or self._late < 0.0:
            raise InputError(
                'a stream cannot run ahead of its command: give clock-skew >= 0, and no lead '
                'beyond the delay'
            )
        self._jitter = float(self._values['jitter'][0])
        self._quantum = float(self._values['quantum'][0])
        self._noise = float(noise_stddev)
        # A controller that reads the transducer gets its noise, jitter and converter steps, too.
        self._heard = bool(self._values['feedback_share'][0] > 0.0) and bool(
            self._noise or self._jitter or self._quantum
        )
        if rng is None and (self._jitter > 0.0 or self._noise > 0.0):
            raise InputError('timing-jitter and sensor noise need a random generator (rng)')
        self._rng = rng
        base = run.sample_steps(self.period, run.turning(structure.program, hold))
        finer = run.refinement(self._values, self.stiffness, self.period / base)
        self._substeps = base * int(finer[0])
        self.reset()

    def reset(self) -> None:
        """Return to rest at zero displacement, sample 0 (the random generator runs on)."""
        start = (0.0, 0.0)
        if self.structure.linear:
            linear = self.hold == 'linear'
            self._table = linear_effects.tables(
                self._values, self.stiffness, self.period, linear, start
            )[0]
        else:
            self._table = run.tables(
                self._values,
                self.structure.program,
                self.stiffness,
                self._substeps,
                self.period,
                start,
            )[0]
        self._history = np.zeros(1)
        self._offset = -1
        self._begin = 0
        self._last = 0.0

    def step(self, command: ArrayLike) -> tuple[Array, Array]:
        """Return measured displacement [m] and actuator force [N] at the samples of a block.

        The sample that arrives with u[i] does not depend on u[i] under zero-order hold.

        Args:
            command: the next command samples, shape (n,) [m].

        Raises:
            InputError: the command is not one row of finite samples; the state stays.
        """
        block = np.asarray(command, dtype=np.float64)
        if block.ndim != 1 or not np.isfinite(block).all():
            raise InputError(
                f'command block of shape {block.shape} must be one row of finite samples [m]'
            )
        if self._heard and len(block) > 1:
            parts = [self.step(sample) for sample in block[:, np.newaxis]]
            return np.concatenate([y for y, _ in parts]), np.concatenate([f for _, f in parts])
        u = np.concatenate([self._history, block])
        out = np.empty((len(block), layout.LANES))
        force = np.empty_like(out)
        self._advance(u, out, force)
        samples = np.arange(self._begin, self._begin + len(block), dtype=np.float64)
        self._begin += len(block)
        self._forget(u)
        y = self.structure.sensed(self.theta[np.newaxis], samples * self.period, out[:, :1])[:, 0]
        measured = self._measured(y)
        if self._heard and len(block):
            self._table[layout.HELD : layout.HELD + layout.LANES] = measured[-1] - y[-1]
        return measured, force[:, 0].copy()

    def _advance(self, u: Array, out: Array, force: Array) -> None:
        """Run the compiled step through the samples after `_begin`."""
        at = u, self._offset, self._begin
        if self.structure.linear:
            third, delayed = self.structure.exact
            linear_step.advance(self._table, third, delayed, *at, out, force)
        else:
            kernel.advance(
                self._table,
                self.structure.switches,
                self.structure.program.parts,
                *at,
                self._substeps,
                self.period,
                self.hold == 'linear',
                out,
                force,
            )

    def _forget(self, u: Array) -> None:
        """Keep the command samples that later steps may ask for."""
        lag = self._late / self.period + self._values['clock_skew'][0] * self._begin
        keep = min(len(u), math.ceil(lag) + 3)
        self._history = u[len(u) - keep :].copy()
        self._offset = self._begin - keep

    def _measured(self, y: Array) -> Array:
        """Return y with timing jitter, noise and converter steps."""
        if self._rng is not None and len(y):
            draws = self._rng.standard_normal((len(y), 2))
            velocity = np.diff(y, prepend=self._last) / self.period
            self._last = float(y[-1])
            y = y + self._jitter * velocity * draws[:, 0] + self._noise * draws[:, 1]
        if self._quantum > 0.0:
            y = self._quantum * np.round(y / self._quantum)
        return y
