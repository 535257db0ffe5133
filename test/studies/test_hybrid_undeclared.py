"""Predictions of a hybrid test are wrong with an undeclared effect, and right with it found."""

import numpy as np
import pytest

from studies.hybrid import hidden_effects


@pytest.mark.parametrize('case', hidden_effects.CASES)
def test_an_actuator_has_what_its_case_says(case: str) -> None:
    """One effect beyond Eq. (2), which its pre-tests show; its own hybrid test is stable."""
    own = hidden_effects.actuator(case, 1)
    hidden = hidden_effects.CASES[case]
    assert own.effects == (hidden.effect,) and own.theta[-1] == hidden.value
    free, clamped = own.records(64.0, 4.0)
    assert free.stiffness == 0.0 and clamped.stiffness == own.test.specimen.stiffness
    run = own.run()
    assert not run.diverged[0] and np.isfinite(run.response).all()


@pytest.mark.slow
@pytest.mark.timeout(900)
@pytest.mark.parametrize('case', hidden_effects.CASES)
def test_the_diagnosis_makes_the_prediction_right(case: str) -> None:
    """The effect is named; with Eq. (2) alone the band or the probability is wrong."""
    told = hidden_effects.story(case)
    assert told.diagnosis.structure == (hidden_effects.CASES[case].effect,)
    assert not told.right(told.before)
    assert told.right(told.after)
    assert hidden_effects.figure([told]).axes
