"""Joined samples leap where others do not count: derivatives and filters go run by run."""

from dataclasses import replace

import numpy as np
import pytest
from two_sweeps import RATE, THETA, sweep

from actuator_glue.diagnosis.score.scorer import Scorer, splits_of
from actuator_glue.diagnosis.verdict.alarm import statistics
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array, Record


def swept() -> tuple[Data, Array]:
    """A sweep of which every fourth stretch of 2 s does not count, and its velocity [m/s]."""
    command = sweep(2e-3, 6.0, 40.0)
    record = Record(command, np.zeros_like(command), 1.0 / RATE, stiffness=0.0)
    motion = np.asarray(Structure(()).simulate(THETA, record)).reshape(-1)
    data = Data.whole([replace(record, measured=motion)])
    counted = np.floor(record.time / 2.0).astype(int) % 4 != 3
    return replace(data, masks=(counted,)), np.gradient(motion, record.period)[counted]


@pytest.mark.parametrize(('power', 'share'), [(2, 'even_share'), (3, 'odd_share')])
def test_powers_of_velocity_are_told_beside_gaps(power: int, share: str) -> None:
    """A residual that is a power of the velocity; the leaps of the joined motion hide it."""
    data, velocity = swept()
    # One-sided at the ends of runs, else as in the whole record.
    assert np.mean(np.abs(data.velocity(data.target) - velocity) > 1e-9) < 0.01
    error = velocity**power / np.std(velocity**power) * 1e-6
    held = replace(data, records=(replace(data.records[0], measured=_with(data, error)),))
    assert statistics(held, error)[share] > 0.98


def _with(data: Data, error: Array) -> Array:
    measured = np.array(data.records[0].measured)
    measured[data.masks[0]] += error
    return measured


def test_rows_of_one_record_are_whitened_as_rows_of_all(rng_seed: int) -> None:
    """With strongly coloured noise the filters of a run and of joined runs differ most."""
    data, _ = swept()
    data = Data(
        data.records * 2, data.masks * 2, data.initials * 2, data.recorded * 2, data.origins * 2
    )
    rng = np.random.default_rng(rng_seed)
    slow = 1e-6 * np.cumsum(rng.standard_normal(data.target.size))
    scorer = Scorer.of(data, splits_of(data, slow))
    whole = scorer.whiten(data.target)
    for i, part in enumerate(data.parts):
        own = scorer.whiten(data.target[part], i)
        np.testing.assert_array_equal(own, whole[part])
