"""How often names are right that a share of the weight stands behind."""

import pytest

from actuator_glue.diagnosis.estimate import Estimate
from actuator_glue.diagnosis.score.reliability import calibrated, share_of, sureness


def test_more_weight_is_never_less_probable_and_never_certain() -> None:
    told = [calibrated(share / 100) for share in range(101)]
    assert told == sorted(told)
    assert 0.0 < told[0] < 0.5 < told[-1] < 1.0


def test_a_straight_line_between_luck_and_knowledge() -> None:
    assert calibrated(0.75, (0.1, 0.9)) == pytest.approx(0.7)
    assert share_of(0.7, (0.1, 0.9)) == pytest.approx(0.75)


@pytest.mark.parametrize(
    ('mean', 'stddev', 'neutral', 'sure'),
    [
        (1.96, 1.0, 0.0, 0.975),
        (-1.96, 1.0, 0.0, 0.975),
        (1.0, 2.0, 1.0, 0.5),
        (1.0, 1.0, None, 1.0),
        (1.0, 0.0, 0.0, 1.0),
    ],
)
def test_a_size_that_may_be_nothing(
    mean: float, stddev: float, neutral: float | None, sure: float
) -> None:
    size = Estimate(mean, stddev, mean - stddev, mean + stddev, 'm', neutral)
    assert sureness(size) == pytest.approx(sure, abs=1e-4)
