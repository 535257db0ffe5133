"""Reading amplitude and phase off reconstructed sweeps."""

import numpy as np
import pytest

from actuator_glue.model import reference_problem
from studies.chen.experiment import (
    blocks,
    empirical_response,
    held,
    identified_response,
    read_off,
)
from studies.chen.published import CLOSE_UPS


@pytest.mark.parametrize('test', [0, 1])
def test_sweeps_give_back_their_transfer_function(test: int) -> None:
    record = reference_problem.records(noise=0.0)[test]
    # The sweep moves 0.17 Hz/s while the response settles in 50 ms: 0.5 % is what that leaves.
    for reading in read_off(record, test, CLOSE_UPS):
        assert reading.amplitude == pytest.approx(abs(reading.expected), rel=5e-3)
        assert reading.phase == pytest.approx(np.angle(reading.expected), abs=5e-3)
        assert reading.delay == pytest.approx(-reading.phase / 2 / np.pi / reading.frequency_hz)
    grid = np.linspace(0.2, 10, 50)
    ratio = empirical_response(record, test, grid) / identified_response(test, grid)
    assert np.abs(ratio - 1).max() < 6e-3


def test_the_spring_test_decays_and_lags_more() -> None:
    free, spring = (read_off(r, i, CLOSE_UPS) for i, r in enumerate(reference_problem.records()))
    for one, other in zip(free, spring, strict=True):
        assert other.delay > one.delay
    assert spring[1].decay > free[1].decay and spring[2].decay > free[2].decay


def test_hold_is_half_a_sample_of_delay() -> None:
    frequency = np.array([0.5, 5.0])
    response = held(np.ones(2, dtype=complex), frequency, 0.005)
    np.testing.assert_allclose(-np.angle(response) / (2 * np.pi * frequency), 0.0025)
    # Against the exact discrete response of a sine, long after its start.
    time = np.arange(0, 20, 0.005)
    a1, a0, b0 = reference_problem.EQUATION_3[0]
    from actuator_glue.model import linear

    x = linear.respond(np.array([[a1, a0, b0]]), np.sin(2 * np.pi * 5 * time), period=0.005)[0]
    late = time >= 10
    basis = np.stack([np.sin(2 * np.pi * 5 * time), np.cos(2 * np.pi * 5 * time)], axis=1)
    a, b = np.linalg.lstsq(basis[late], x[late], rcond=None)[0]
    expected = held(identified_response(0, frequency), frequency, 0.005)[1]
    assert abs(a + 1j * b - expected) < 1e-3


def test_blocks_share_a_record_out_evenly_and_wholly() -> None:
    record = reference_problem.records(1)[0]
    fit, held_out = blocks(record)
    covered = held_out.astype(int)
    for part in fit:
        covered[part] += 1
    assert covered.max() == 1
    assert covered.sum() >= len(record) - 1  # the sweep's last sample falls off
    assert held_out.sum() == pytest.approx(len(record) / 2, rel=0.01)
