"""Virtual hybrid tests: every draw of a posterior runs the record in its own loop."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from actuator_glue.hybrid import adaptation, virtual_kernel
from actuator_glue.hybrid.actuator import actuator, nonlinear, table_of
from actuator_glue.hybrid.compensator import Compensator
from actuator_glue.hybrid.indicators import largest_lag
from actuator_glue.hybrid.partition import Partition
from actuator_glue.hybrid.sampled import Plants, numerical, plants, reference
from actuator_glue.hybrid.virtual_kernel import LANES
from actuator_glue.hybrid.virtual_lanes import Found, Lanes, SharedInputs
from actuator_glue.model.effects import run
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array

# A draw whose floors move this much further than the reference's has left every test behind.
DIVERGED = 5.0
_SLOWEST = 0.05  # Hz, of a structure that adapts a compensator
_ENOUGH = 1000.0  # Hz, ten samples a period of whatever a structure or a piston does
_KEPT = 8000  # numbers of the response that are kept of each draw


@dataclass(frozen=True, slots=True, eq=False)
class Responses:
    """What each of m draws did.

    Attributes:
        j1, j2, j3: tracking criteria of the piston, (m,) [s, -, -].
        rms_error, peak_error: of each floor against the reference, over the reference's, (n, m).
        displacement, drift: peaks of each floor, drift against the one below, (n, m) [m].
        force: peak of the specimen's force, (m,) [N].
        diverged: whether the floors went beyond DIVERGED times the reference, (m,).
        response, whole: floors of test and reference, (times, n, m) [m].
    """

    j1: Array
    j2: Array
    j3: Array
    rms_error: Array
    peak_error: Array
    displacement: Array
    drift: Array
    force: Array
    diverged: NDArray[np.bool_]
    response: Array
    whole: Array


class VirtualTest:
    """A hybrid test that all draws of a posterior run side by side, 32 to a block.

    Args:
        partition: the hybrid test.
        draws: parameters, shape (m, p), SI units.
        names: parameter of each column.
        effects: effects of the model beyond Eq. (2).
        specimen: mass, damping, stiffness of each draw, (m,) each.
        compensator: between target and command.
        ground: ground acceleration at the loop's samples, (n,) [m/s^2].
        seed: of the sensors' noise.

    Attributes:
        blocks: how many there are.
        time: of the responses kept, (times,) [s].
    """

    def __init__(
        self,
        partition: Partition,
        draws: Array,
        names: Sequence[str],
        effects: Sequence[str],
        specimen: Mapping[str, Array],
        compensator: Compensator,
        ground: Array,
        seed: int,
    ) -> None:
        self._structure = Structure(effects)
        self._curved = bool(nonlinear(effects))
        self._table = table_of(draws, names, self._structure)
        self._specimen = specimen
        self._partition = partition
        self._numerical = numerical(partition)
        self._reference = reference(partition, specimen)
        self._compensator = compensator
        self._seed = seed
        self._plants: Plants | None = None
        self._substeps = 1
        if self._curved:
            times = run.turning(self._structure.program, 'zoh')
            base = run.sample_steps(partition.period, times)
            values = self._structure.values(self._table)
            soft = float(specimen['stiffness'].min())
            self._substeps = base * int(
                run.refinement(values, soft, partition.period / base).max()
            )
        else:
            found = actuator(draws, names, effects, specimen['stiffness'])
            self._plants = plants(found, specimen, partition)
        floors = len(partition.mass)
        stride = max(1, -(-len(ground) * floors // _KEPT))
        self.time = np.asarray(np.arange(0, len(ground), stride) * partition.period)
        noise = np.array([partition.displacement_noise, partition.force_noise])
        self._course = SharedInputs(
            np.ascontiguousarray(ground),
            partition.period,
            noise,
            stride,
            compensator.adaptive,
            adaptation.smoothing(
                partition.period,
                partition.displacement_noise,
                float(max(partition.natural_frequencies[0], _SLOWEST)),
            ),
        )
        self.blocks = -(-len(draws) // LANES)

    def run(self, block: int) -> Responses:
        """Return what the draws of one block did; blocks may run in threads of their own."""
        count = min(len(self._table) - block * LANES, LANES)
        return _summary(self.histories(block), count, self._partition.period)

    def histories(self, block: int) -> Found:
        """Return what the kernel leaves of one block, LANES wide."""
        count = len(self._table)
        which = np.arange(block * LANES, (block + 1) * LANES).clip(max=count - 1)
        floors, n = len(self._partition.mass), len(self._course.ground)
        kept = (len(self.time), floors, LANES)
        found = Found(
            np.empty((LANES, n)),
            np.empty((LANES, n)),
            np.zeros((2, floors, LANES)),
            np.zeros((4, floors, LANES)),
            np.zeros(LANES),
            np.empty(kept),
            np.empty(kept),
        )
        ats = np.repeat(self._compensator.coefficients[:, None], LANES, axis=1)
        rng = np.random.default_rng((self._seed, block))
        shared = (self._numerical, self._lanes(which), self._course, ats, rng, found)
        if self._curved:
            parts = self._structure.program.parts
            on = self._structure.switches
            virtual_kernel.run_effects(*shared, on, parts, self._substeps)
        else:
            virtual_kernel.run_linear(*shared)
        return found

    def _lanes(self, which: NDArray[np.intp]) -> Lanes:
        """Return the lanes of some draws, (LANES,)."""
        step, ground = (np.moveaxis(part[which], 0, -1).copy() for part in self._reference)
        specimen = np.array(
            [self._specimen[name][which] for name in ('stiffness', 'damping', 'mass')]
        )
        if self._plants is not None:
            p = self._plants
            linear = [
                np.moveaxis(part[which], 0, -1).copy() for part in (p.step, p.command, p.speed)
            ]
            return Lanes(
                step,
                ground,
                specimen,
                linear[0],
                linear[1],
                linear[2],
                p.shown,
                np.empty(0),
                np.zeros(LANES),
            )
        table, lag = self._effects(which)
        nothing = np.empty((0, LANES))
        return Lanes(
            step,
            ground,
            specimen,
            np.empty((0, 0, LANES)),
            nothing,
            nothing,
            np.empty(0),
            table,
            lag,
        )

    def _effects(self, which: NDArray[np.intp]) -> tuple[Array, Array]:
        """Return the kernel's table of some draws and their commands' lag [samples].

        A table knows one specimen, so that each draw gets one and gives it a lane.
        """
        period = self._partition.period
        values = self._structure.values(self._table[which])
        columns = []
        for i, draw in enumerate(which):
            one = {name: column[i : i + 1] for name, column in values.items()}
            k = float(self._specimen['stiffness'][draw])
            table = run.tables(one, self._structure.program, k, self._substeps, period, (0.0, 0.0))
            columns.append(table.reshape(-1, LANES)[:, i])
        delay = values['delay'] + self._partition.computation_delay
        return np.stack(columns, axis=1).ravel(), np.maximum(delay, 0.0) / period


def joined(parts: Iterable[Responses]) -> Responses:
    """Return the responses of several blocks as one, in their order."""
    together = list(parts)
    every: list[Any] = [
        np.concatenate([getattr(part, name) for part in together], axis=-1)
        for name in Responses.__slots__
    ]
    return Responses(*every)


def lags(target: Array, moved: Array, period: float) -> Array:
    """Return the lag of the largest cross-correlation of each row, (m,) [samples].

    That of J1 (`TargetMotion.criteria`) at a part of its time: the summit is looked for among all
    lags in every few samples, and climbed to in all of them. A climb from no lag would stop on the
    way where a structure has several frequencies, or leap over a period where its steps are long.

    Args:
        target: displacements asked for, (m, n) [m].
        moved: displacements reached, (m, n) [m].
        period: between samples [s].

    Returns:
        NaN for rows that are not finite.
    """
    every = max(1, int(1.0 / (_ENOUGH * period)))
    found = np.full(len(target), np.nan)
    for row in np.flatnonzero(np.isfinite(target).all(axis=1) & np.isfinite(moved).all(axis=1)):
        found[row] = every * largest_lag(target[row, ::every], moved[row, ::every])
    virtual_kernel.climb(target, moved, every // 2, found)
    return found


@np.errstate(all='ignore')  # what diverges is no number in the end
def _summary(found: Found, count: int, period: float) -> Responses:
    lag = lags(found.target, found.moved, period)
    error = found.moved - found.target
    j2 = np.sqrt((error**2).mean(axis=1) / (found.target**2).mean(axis=1))
    j3 = np.abs(error).max(axis=1) / np.abs(found.target).max(axis=1)
    furthest, perfect = found.peaks[2].max(axis=0), found.peaks[1].max(axis=0)
    lost = ~(furthest <= DIVERGED * perfect) | ~np.isfinite(found.moved[:, -1])
    every: tuple[Any, ...] = (
        lag * period,
        j2,
        j3,
        np.sqrt(found.sums[0] / found.sums[1]),
        found.peaks[0] / found.peaks[1],
        found.peaks[2],
        found.peaks[3],
        found.force,
        lost,
        found.response,
        found.whole,
    )
    return Responses(*(part[..., :count].copy() for part in every))
