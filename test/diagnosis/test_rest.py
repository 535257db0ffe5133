"""Noise at rest beside noise in motion."""

from dataclasses import replace

import numpy as np
import pytest

from actuator_glue.diagnosis.diagnose import diagnose
from actuator_glue.diagnosis.thresholds import Thresholds
from actuator_glue.hygiene.clean import initial_state, rest_samples
from actuator_glue.hygiene.rest import compared, noise_at_rest
from actuator_glue.model.structure import Structure
from actuator_glue.records import Record

RATE = 256.0
THETA = np.array([235.0, 5.0e10, 4.23e6, 3.3])


def machine(still: float, moving: float, rest: float = 3.0) -> Record:
    """Return a sweep of 30 s after a rest [s], with noise of these sizes [m]."""
    t = np.arange(int(30 * RATE)) / RATE
    sweep = 2e-3 * np.sin(np.pi * (10.0 / 30.0) * t**2)
    command = np.concatenate([np.zeros(int(rest * RATE)), sweep])
    bare = Record(command, np.zeros(len(command)), 1 / RATE, stiffness=250e3, source='test.csv')
    x = Structure(()).simulate(THETA, bare)
    size = np.where(command == 0.0, still, moving)
    noise = size * np.random.default_rng(4).standard_normal(len(x))
    return replace(bare, measured=x + noise)


@pytest.mark.slow
@pytest.mark.parametrize(
    ('still', 'moving', 'said'),
    [
        (2e-6, 1e-5, 'come with the motion'),
        (1e-5, 1e-5, None),
        (1e-5, 3e-6, 'calms down'),
    ],
)
def test_a_noise_that_comes_with_the_motion_is_told(
    still: float, moving: float, said: str | None
) -> None:
    found = diagnose([machine(still, moving)], settings=Thresholds(evaluations=0))
    notes = [n for n in found.advice if 'noise at rest' in n]
    assert bool(notes) is bool(said)
    assert said is None or said in notes[0]
    (row,) = found.to_json()['sampling']
    # A standard deviation of 690 values is known to 2.7 %: four times that.
    assert row['noise_at_rest_m'] == pytest.approx(still, rel=0.11)


def test_nothing_is_said_without_rest_or_noise() -> None:
    record = machine(1e-6, 1e-5)
    assert noise_at_rest(record, 99) is None
    assert compared([record], [None], 1e-5) == ()
    assert compared([record], [0.0], 1e-5) == ()


def test_a_piston_that_comes_to_rest_is_not_at_rest() -> None:
    """A test that is asked to begin 2 mm away: the way there is no noise."""
    record = machine(1e-5, 1e-5)
    away = 2e-3 * (1.0 - np.exp(-record.time / 0.05))
    begun = replace(record, command=record.command + 2e-3, measured=record.measured + away)
    rest = rest_samples(begun)
    assert initial_state(begun) == 'measured' and rest * begun.period > 2.0
    # A standard deviation of 430 values is known to 3.4 %: four times that.
    assert noise_at_rest(begun, rest, 'measured') == pytest.approx(1e-5, rel=0.14)
    assert noise_at_rest(begun, round(1.3 * RATE), 'measured') is None
