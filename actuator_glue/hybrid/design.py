"""The loop of a hybrid test with a posterior's draws in it, and compensators made for it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.hybrid.actuator import Actuator, actuator
from actuator_glue.hybrid.compensator import HIGHEST, KINDS, LOWEST, Compensator, inverse
from actuator_glue.hybrid.coupled import coupled
from actuator_glue.hybrid.linear_system import System
from actuator_glue.hybrid.loop import substructures
from actuator_glue.hybrid.partition import Partition
from actuator_glue.hybrid.robust import DRAWS, robust, spectrum
from actuator_glue.hybrid.sampled import Numerical, Plants, growth, numerical, plants, reference
from actuator_glue.model.commands import ground_acceleration
from actuator_glue.records import Array

_SEED, _DURATION = 0, 20.0  # s, of the artificial ground motion whose target a robust one follows


@dataclass(frozen=True, eq=False)
class Loop:
    """A partition with an actuator and a specimen for each of m draws.

    Attributes:
        partition: the hybrid test.
        draws: parameters, (m, p), SI units.
        names: parameter of each column.
        effects: effects of the model beyond Eq. (2).
        specimen: mass, damping, stiffness, (m,) each.
        actuators: linear part of each draw's actuator.
        mean: that of the mean draw with the nominal specimen.
    """

    partition: Partition
    draws: Array
    names: Sequence[str]
    effects: Sequence[str]
    specimen: Mapping[str, Array]
    actuators: Actuator
    mean: Actuator

    @classmethod
    def of(
        cls,
        partition: Partition,
        draws: Array,
        names: Sequence[str],
        effects: Sequence[str],
        specimen: Mapping[str, Array],
    ) -> Loop:
        """Return the loop of these draws.

        Raises:
            InputError: draws without an Eq. (2a), or of a record that leads its command.
        """
        if 'lead' in effects:
            raise InputError(
                'the model leads its command, as behind a compensator: calibrate with the command '
                'as the controller gets it, both channels read at the same instant, and give the '
                'compensator to the hybrid test'
            )
        stiffness = np.array([partition.specimen.stiffness])
        return cls(
            partition,
            draws,
            names,
            effects,
            specimen,
            actuator(draws, names, effects, specimen['stiffness']),
            actuator(draws.mean(axis=0)[None], names, effects, stiffness),
        )

    @cached_property
    def numerical(self) -> Numerical:
        """What the actuator sees of the numerical substructure, over one sample."""
        return numerical(coupled(self.partition))

    @cached_property
    def plants(self) -> Plants:
        """The linear actuators over one sample."""
        return plants(self.actuators, self.specimen, self.partition)

    @property
    def late(self) -> float:
        """Delay of computation and of the command that is held over a sample [s]."""
        return self.partition.computation_delay + 0.5 * self.partition.period


def compensator_of(kind: str, loop: Loop, ground: Array | None = None) -> Compensator:
    """Return a compensator for the draws of a loop.

    Args:
        kind: one of KINDS.
        loop: partition and draws.
        ground: acceleration at the loop's samples whose response a robust one is made to follow,
            (n,) [m/s^2]; None for an artificial one.

    Raises:
        InputError: an unknown kind, or a mean actuator that cannot be inverted.
    """
    if kind not in KINDS:
        raise InputError(f'compensator {kind!r} is unknown; use one of {", ".join(KINDS)}')
    if kind == 'none':
        return Compensator('none', np.array([1.0, 0.0, 0.0]))
    undone = inverse(loop.mean.system, loop.late + float(loop.mean.delay[0]))
    if kind == 'inverse':
        return Compensator('inverse', undone)
    if kind == 'robust':
        if ground is None:
            ground = ground_acceleration(loop.partition.rate, _DURATION, seed=_SEED)
        return Compensator('robust', _robust(loop, undone, ground))
    within = np.clip(undone, LOWEST, HIGHEST)
    return Compensator('ats', within, True) if kind == 'ats' else Compensator('ats-fixed', within)


def _robust(loop: Loop, first: Array, ground: Array) -> Array:
    """Return the robust coefficients, or `first` where they make more draws unstable."""
    period = loop.partition.period
    s, power = spectrum(_target(loop.partition, ground), period)
    rows = np.unique(np.linspace(0, len(loop.draws) - 1, DRAWS).astype(np.intp))
    at = np.broadcast_to(s, (len(rows), len(s)))
    system = System(*(part[rows] for part in loop.actuators.system))
    late = loop.actuators.delay[rows, None] + loop.late
    specimen = {name: column[rows] for name, column in loop.specimen.items()}
    open_loop = substructures(loop.partition, specimen).response(at)
    found = robust(first, system.response(at) * np.exp(-s * late), open_loop, s, power)
    p = loop.plants
    plants = Plants(p.step[rows], p.command[rows], p.speed[rows], p.shown, p.specimen[:, rows])
    before, after = (growth(loop.numerical, plants, c, period) > 0.0 for c in (first, found))
    return found if after.sum() <= before.sum() else first


def _target(partition: Partition, ground: Array) -> Array:
    """Return the interface's displacement in the reference structure, (n,) [m]."""
    steps, grounds = reference(partition, partition.specimen.nominal)
    state, out = np.zeros(len(grounds[0])), np.empty(len(ground))
    for i, acceleration in enumerate(ground):
        out[i] = state[partition.interface]
        state = steps[0] @ state + grounds[0] * acceleration
    return out
