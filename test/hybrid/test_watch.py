"""Watching the stability: the same numbers as `rths`, a warning with hysteresis."""

import numpy as np
import pytest

import actuator_glue as ag
from actuator_glue.hybrid.watch import MarginWatch

NAMES = ('beta_1', 'alpha_1_beta_0', 'alpha_2', 'alpha_3')
THETA = np.array([133.65, 1.1005e9, 2.4927e5, 0.006])


def partition(damping: float = 0.096) -> ag.Partition:
    """One degree of freedom at 1 Hz, all stiffness in the specimen."""
    w = 2.0 * np.pi
    return ag.Partition(
        mass=1000.0,
        damping=2.0 * damping * w * 1000.0,
        stiffness=0.0,
        specimen=ag.Specimen(0.0, 0.0, w**2 * 1000.0),
        rate=4096.0,
    )


def draws(unstable: int) -> np.ndarray:
    """A hundred draws, so many of them too slow for the loop."""
    out = np.tile(THETA, (100, 1))
    out[:unstable, 0] *= 1.5
    return out


def test_a_warning_holds_until_it_is_clearly_over() -> None:
    """Above 5 % it begins; between 2 and 5 % what was goes on; below 2 % it ends."""
    watch = MarginWatch(partition(0.12))
    for unstable, warns in ((0, False), (4, False), (6, True), (3, True), (1, False), (3, False)):
        found = watch.take(draws(unstable), NAMES, (), 100.0)
        assert found.p_unstable.value == unstable / 100
        assert found.warning == warns == watch.warning


def test_numbers_are_those_of_rths() -> None:
    """Margin, growth, tracking, the interval of P(unstable)."""
    from test_rths import posterior

    posterior_found = posterior(0.02)
    whole = ag.rths(partition(), posterior_found, frequencies=(5.0,))
    watch = MarginWatch(partition(), frequencies=(5.0,))
    found = watch.take(posterior_found.posterior, NAMES, (), 900.0)
    assert found.p_unstable == whole.p_unstable
    assert found.growth[1] == pytest.approx(whole.growth_per_s.median)
    assert found.delay[0, 0] == pytest.approx(whole.tracking[0].delay_s.lower)
    assert found.bandwidth[2] == pytest.approx(whole.bandwidth_hz.upper)
    assert found.most_sensitive == whole.most_sensitive


@pytest.mark.parametrize(
    'wrong',
    [
        {'coefficients': (1.0, 0.0)},
        {'coefficients': (1.0, 0.0, np.nan)},
        {'frequencies': ()},
        {'frequencies': (1e6,)},
        {'warn_above': 0.1, 'clear_below': 0.2},
        {'warn_above': 1.5},
    ],
)
def test_what_cannot_be_watched(wrong: dict[str, object]) -> None:
    """One error."""
    with pytest.raises(ag.InputError):
        MarginWatch(partition(), **wrong)


@pytest.mark.parametrize(
    ('value', 'names', 'effective', 'told'),
    [
        (
            np.nan,
            NAMES,
            100.0,
            '1 of 100 draws are NaN or infinite, the first in alpha_2 of draw 7',
        ),
        (
            np.inf,
            NAMES,
            100.0,
            '1 of 100 draws are NaN or infinite, the first in alpha_2 of draw 7',
        ),
        (THETA[2], NAMES, np.nan, 'ess_min of 100 draws is NaN'),
        (THETA[2], (*NAMES[:3], 'other'), 100.0, 'none of alpha_3'),
    ],
)
def test_what_came_and_cannot_be_used_is_said(
    value: float, names: tuple[str, ...], effective: float, told: str
) -> None:
    """One error, and what follows is taken as if it had not come."""
    watch = MarginWatch(partition(0.12))
    assert watch.take(draws(6), NAMES, (), 100.0).warning
    broken = draws(0)
    broken[7, 2] = value
    with pytest.raises(ag.InputError, match=told):
        watch.take(broken, names, (), effective)
    assert watch.warning
    assert watch.take(draws(3), NAMES, (), 100.0).p_unstable.value == 0.03


@pytest.mark.filterwarnings('ignore:.*encountered in')
def test_draws_without_a_root_are_not_stable_ones() -> None:
    """Finite, and beyond what numbers hold: NaN is not above zero, but says nothing either."""
    broken = draws(0)
    broken[7] = 1e300
    with pytest.raises(ag.InputError, match='no roots to compute'):
        MarginWatch(partition()).take(broken, NAMES, (), 100.0)
