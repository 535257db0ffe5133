"""A search ends at its effort and says so; what is known at first is told at once."""

import numpy as np
import pytest

from actuator_glue.diagnosis.diagnose import diagnose
from actuator_glue.diagnosis.effort import Effort
from actuator_glue.diagnosis.thresholds import Thresholds
from actuator_glue.diagnosis.verdict.first_look import FirstLook
from actuator_glue.inference.least_squares.fit import Fit
from actuator_glue.model.structure import Structure
from actuator_glue.records import Record

RATE, NOISE = 100.0, 1e-5
THETA = [128.0, 1.01e9, 2.42e5, 0.3]


def record(seed: int) -> Record:
    """A sweep of 12 s to 6 Hz with 60 um of play."""
    t = np.arange(round(12.0 * RATE)) / RATE
    command = 2e-3 * np.sin(np.pi * 0.5 * t**2)
    bare = Record(command, np.zeros(len(t)), 1.0 / RATE, stiffness=250e3)
    y = Structure(['backlash']).simulate(np.array([*THETA, 6e-5]), bare)
    noise = NOISE * np.random.default_rng(seed).standard_normal(len(t))
    return Record(command, y + noise, 1.0 / RATE, stiffness=250e3)


@pytest.mark.slow
def test_a_search_ends_at_its_effort_and_says_so() -> None:
    """Twice the same, and less than a search that may go on; seeds are fixed."""
    looks: list[FirstLook] = []
    few = Thresholds(effort=1.0, evaluations=0)
    first, again = (diagnose([record(1)], settings=few, first_look=looks.append) for _ in range(2))
    assert first.to_json() == again.to_json()
    assert first.effort >= 1.0
    assert any('ended at its effort' in line for line in first.advice)
    whole = diagnose([record(1)], settings=Thresholds(evaluations=0))
    assert 0.0 < whole.effort < 1.0
    assert not any('ended at its effort' in line for line in whole.advice)
    assert whole.effort * Thresholds().effort > first.effort
    assert 'backlash' in whole.structure
    assert whole.error.after <= first.error.after

    assert looks[0] == looks[1]
    look = looks[0]
    assert look.missing
    assert look.noise_m < 0.7 * look.error_m
    assert look.error_m**2 == pytest.approx(look.noise_m**2 + look.structure_m**2, rel=1e-6)
    assert 'more than noise' in look.sentence()


def test_nothing_is_missing_of_noise() -> None:
    """Eq. (2) itself leaves nothing that matters."""
    seen: list[FirstLook] = []
    bare = record(2)
    y = Structure(()).simulate(np.array(THETA), bare)
    noise = NOISE * np.random.default_rng(3).standard_normal(len(bare))
    healthy = Record(bare.command, y + noise, bare.period, stiffness=250e3)
    diagnose(
        [healthy], settings=Thresholds(evaluations=0, effort=1.0, most=0), first_look=seen.append
    )
    assert not seen[0].missing
    assert 'nothing that matters shows yet' in seen[0].sentence()


def test_a_search_in_another_scope_may_go_beyond() -> None:
    """By half of the effort, which is one and the same."""
    effort = Effort(100.0)
    late = effort.extended()
    for work in (90, 20):
        effort.spent_on(Fit(np.zeros(4), np.zeros(1), np.zeros((4, 1)), np.zeros(4), work=work))
    assert effort.over and not late.over
    assert late.share == effort.share == 1.1
    late.spent_on(Fit(np.zeros(4), np.zeros(1), np.zeros((4, 1)), np.zeros(4), work=40))
    assert late.over and effort.share == 1.5
