"""What is told of a finding: no probability beyond what its own interval says."""

import pytest
import scipy

from actuator_glue.diagnosis.estimate import Estimate
from actuator_glue.diagnosis.finding import Rival
from actuator_glue.diagnosis.score.reliability import calibrated
from actuator_glue.diagnosis.verdict import findings


def size(lower: float, upper: float, neutral: float | None) -> Estimate:
    """A size of which interval and neutral value matter."""
    return Estimate(0.5 * (lower + upper), 1.0, lower, upper, '1', neutral)


@pytest.mark.parametrize('far', [0.0, 1.0, 5.0])
def test_a_name_whose_size_may_be_nothing_is_not_sure(far: float) -> None:
    """All names in its place keep their odds, and none of these has the rest."""
    rows = [Rival(n, 0.0, 0.0, 0.0, True, p) for n, p in (('delay', 0.9), ('sensor-lag', 0.1))]
    told = findings._told(rows, 0.95, [size(far - 2.0, far + 2.0, 0.0)])
    side = float(scipy.stats.norm.cdf(far))
    assert sum(r.probability for r in told) == pytest.approx(calibrated(0.95 * side))
    assert told[1].probability / told[0].probability == pytest.approx(1 / 9)


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
    found = any(map(findings._excludes_neutral, findings._how_much(sizes)))
    assert found is excluded
