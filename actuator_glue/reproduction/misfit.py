"""The paper's own residual: a static gain above one, which Eq. (2a) cannot give."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from actuator_glue.model.parameters import TABLE_2, Parameter, bounds
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array, Record
from actuator_glue.reproduction.physical import least
from actuator_glue.reproduction.posterior import Progress
from actuator_glue.reproduction.shaping import blocks
from actuator_glue.residual.diagnose import diagnose
from actuator_glue.residual.diagnosis import Diagnosis

BIN = 0.5  # Hz, width of the ranges that residuals are shown by
SWEEP_RATE = 10.0 / 60.0  # Hz/s


class SpringGain:
    """Eq. (2) with a static gain in tests with a specimen only: one for the free actuator."""

    def __init__(self) -> None:
        self._with = Structure(('gain',))

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Parameters of Eq. (2), then the gain."""
        return self._with.parameters

    def simulate(self, theta: Array, record: Record) -> Array:
        """Return the displacement of theta (m, 5), shape (m, n) [m]."""
        table = np.array(np.atleast_2d(theta))
        if record.known_stiffness() == 0.0:
            table[:, -1] = 1.0
        return np.asarray(self._with.simulate(table, record))


@dataclass(frozen=True, slots=True, eq=False)
class Refit:
    """A structure refitted on alternate blocks of some tests.

    Attributes:
        name: what was fitted to what.
        tests: which tests (0: free, 1: spring).
        theta: parameters, shape (4,) or (5,) with the gain last.
        fitted: rms error on the fitted blocks of each test [m].
        held_out: rms error on the blocks left out of each test [m].
        residual: measured - simulated of each test [m].
    """

    name: str
    tests: tuple[int, ...]
    theta: Array
    fitted: tuple[float, ...]
    held_out: tuple[float, ...]
    residual: tuple[Array, ...]

    @property
    def gain(self) -> float | None:
        """Static gain found; None where the structure has none."""
        return float(self.theta[4]) if len(self.theta) > 4 else None


def study(records: Sequence[Record]) -> list[Refit]:
    """Refit Eq. (2) with and without a static gain, to the spring test alone and to both tests.

    Args:
        records: test with k = 0, test with k = 250 kN/m.
    """
    base, gain, spring = Structure(), Structure(('gain',)), SpringGain()
    return [
        _refit('Eq. (2), spring test alone', records, (1,), base),
        _refit('Eq. (2) + gain, spring test alone', records, (1,), gain),
        _refit('Eq. (2), both tests', records, (0, 1), base),
        _refit('Eq. (2) + one gain, both tests', records, (0, 1), gain),
        _refit('Eq. (2) + gain with the specimen only, both tests', records, (0, 1), spring),
    ]


def _refit(
    name: str, records: Sequence[Record], tests: tuple[int, ...], model: Structure | SpringGain
) -> Refit:
    chosen = tuple(records[t] for t in tests)
    masks = tuple(_kept(r) for r in chosen)
    lower, upper = bounds(model.parameters)

    def residuals(theta: Array) -> list[Array]:
        return [r.measured - np.ravel(model.simulate(theta[None], r)) for r in chosen]

    def error(theta: Array) -> Array:
        return np.concatenate([e[m] for e, m in zip(residuals(theta), masks, strict=True)])

    start = np.concatenate([TABLE_2, np.ones(len(model.parameters) - len(TABLE_2))])
    theta, _, _ = least(error, start, lower, upper)
    residual = tuple(residuals(theta))

    def rms(error: Array) -> float:
        return float(np.sqrt(np.mean(error**2)))

    return Refit(
        name,
        tests,
        theta,
        tuple(rms(e[m]) for e, m in zip(residual, masks, strict=True)),
        tuple(rms(e[~m]) for e, m in zip(residual, masks, strict=True)),
        residual,
    )


def _kept(record: Record) -> NDArray[np.bool_]:
    mask = np.ones(len(record), dtype=np.bool_)
    for part in blocks(record)[1]:
        mask[part] = False
    return mask


def diagnoses(seed: int, records: Sequence[Record], progress: Progress) -> dict[str, Diagnosis]:
    """Return what the diagnosis, told nothing, says of the spring test alone and of both tests.

    Args:
        seed: of the whole study.
        records: test with k = 0, test with k = 250 kN/m.
        progress: called with the share done.
    """
    alone = diagnose(records[1:], seed=seed, progress=lambda _, share: progress(0.3 * share))
    both = diagnose(records, seed=seed, progress=lambda _, share: progress(0.3 + 0.7 * share))
    return {'spring test alone': alone, 'both tests': both}


def by_frequency(record: Record, residual: Array) -> tuple[Array, Array]:
    """Return centres of frequency ranges [Hz] and the residual's rms in each [m]."""
    frequency = record.time * SWEEP_RATE
    centres: Array = np.arange(BIN / 2, 10.0, BIN, dtype=np.float64)
    power = [
        np.mean(residual[(frequency >= c - BIN / 2) & (frequency < c + BIN / 2)] ** 2)
        for c in centres
    ]
    return centres, np.asarray(np.sqrt(power))
