"""The paper's own residual: a static gain above one, which Eq. (2a) cannot give."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from studies.chen.experiment import blocks, frequencies
from studies.chen.identify import least
from studies.chen.library import NOISE, TABLE_2, Array, Record, Structure

BIN = 0.5  # Hz, width of the ranges that residuals are shown by


class SpringGain(Structure):
    """Eq. (2) with a static gain in tests with a specimen only: one for the free actuator."""

    def __init__(self) -> None:
        super().__init__(('gain',))

    def of(self, theta: Array, record: Record) -> Array:
        """Return theta (5,) as it holds in a test."""
        return np.append(theta[:-1], 1.0) if record.known_stiffness() == 0.0 else theta


@dataclass(frozen=True, slots=True, eq=False)
class Refit:
    """A structure refitted on alternate blocks of some tests.

    Attributes:
        name: what was fitted to what.
        theta: parameters, shape (4,) or (5,) with the gain last.
        fitted: rms error on the fitted blocks by test (0: free, 1: spring) [m].
        held_out: rms error on the blocks left out by test [m].
        residual: measured - simulated by test [m].
    """

    name: str
    theta: Array
    fitted: dict[int, float]
    held_out: dict[int, float]
    residual: dict[int, Array]

    @property
    def gain(self) -> float | None:
        """Static gain found; None where the structure has none."""
        return float(self.theta[4]) if len(self.theta) > 4 else None


def study(records: Sequence[Record]) -> dict[str, Refit]:
    """Refit Eq. (2) with and without a static gain, to the spring test alone and to both tests.

    Args:
        records: test with k = 0, test with k = 250 kN/m.
    """
    spring, both = {1: records[1]}, dict(enumerate(records))
    base, gain = Structure(), Structure(('gain',))
    return {
        'spring': _refit('Eq. (2), spring test alone', spring, base),
        'spring, gain': _refit('Eq. (2) + gain, spring test alone', spring, gain),
        'both': _refit('Eq. (2), both tests', both, base),
        'both, one gain': _refit('Eq. (2) + one gain, both tests', both, gain),
        'both, spring gain': _refit(
            'Eq. (2) + gain with the specimen only, both tests', both, SpringGain()
        ),
    }


def _refit(name: str, tests: dict[int, Record], model: Structure) -> Refit:
    masks = {t: blocks(r)[1] for t, r in tests.items()}

    def residuals(theta: Array) -> dict[int, Array]:
        found = {}
        for t, record in tests.items():
            here = model.of(theta, record) if isinstance(model, SpringGain) else theta
            found[t] = record.measured - np.ravel(model.simulate(here[None], record))
        return found

    def error(theta: Array) -> Array:
        return np.concatenate([e[~masks[t]] for t, e in residuals(theta).items()])

    def rms(error: Array) -> float:
        return float(np.sqrt(np.mean(error**2)))

    start = np.concatenate([TABLE_2, np.ones(len(model.parameters) - len(TABLE_2))])
    theta, _, _ = least(error, start, *model.bounds())
    residual = residuals(theta)
    fitted = {t: rms(e[~masks[t]]) for t, e in residual.items()}
    held_out = {t: rms(e[masks[t]]) for t, e in residual.items()}
    return Refit(name, theta, fitted, held_out, residual)


def removed(before: float, after: float) -> float:
    """Return the share of a residual's power above sensor noise that is gone; rms [m]."""
    return 1.0 - max(after**2 - NOISE**2, 0.0) / (before**2 - NOISE**2)


def by_frequency(record: Record, residual: Array) -> tuple[Array, Array]:
    """Return centres of frequency ranges [Hz] and the residual's rms in each [m]."""
    frequency = frequencies(record)
    centres: Array = np.arange(BIN / 2, 10.0, BIN, dtype=np.float64)
    power = [
        np.mean(residual[(frequency >= c - BIN / 2) & (frequency < c + BIN / 2)] ** 2)
        for c in centres
    ]
    return centres, np.asarray(np.sqrt(power))
