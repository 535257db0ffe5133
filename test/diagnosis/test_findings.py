"""What is told of a finding: no probability beyond what its own interval says."""

import pytest

from actuator_glue.diagnosis import told_effects
from actuator_glue.diagnosis.estimate import Estimate
from actuator_glue.diagnosis.finding import Rival


def size(lower: float, upper: float, neutral: float | None) -> Estimate:
    """A size of which interval and neutral value matter."""
    return Estimate(0.5 * (lower + upper), 1.0, lower, upper, '1', neutral)


@pytest.mark.parametrize('plausible', [True, False])
def test_a_name_whose_size_may_be_nothing_is_not_sure(plausible: bool) -> None:
    """All names in its place keep their odds, and none of these has the rest."""
    rows = [Rival(n, 0.0, 0.0, 0.0, True, p, p) for n, p in (('delay', 0.9), ('sensor-lag', 0.1))]
    told = told_effects._told('delay', rows, 0.95, plausible)
    assert told[0].probability == pytest.approx(0.855 if plausible else 0.7)
    assert told[1].probability / told[0].probability == pytest.approx(1 / 9)
    # What was less sure stays as sure as it was.
    assert told_effects._told('sensor-lag', rows, 0.95, plausible)[1].probability == 0.95 * 0.1


@pytest.mark.parametrize(
    ('sizes', 'excluded'),
    [
        ([size(1.0, 2.0, 0.0)], True),
        ([size(-1.0, 2.0, 0.0)], False),
        # An even part that may be none, and an odd one that is not.
        ([size(-1.0, 2.0, 0.0), size(3.0, 4.0, 0.0)], True),
        # How an effect goes says nothing about how much there is of it.
        ([size(0.0, 2.0, 0.0), size(3.0, 4.0, 20.0)], False),
        ([size(3.0, 4.0, None)], True),
    ],
)
def test_an_interval_without_the_neutral_value(sizes: list[Estimate], excluded: bool) -> None:
    """One of those that say how much there is must exclude it."""
    assert told_effects._excludes_neutral(sizes) is excluded
