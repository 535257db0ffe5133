"""What a history tells of an effect's size holds what one more test tells."""

import numpy as np
import pytest

from actuator_glue.campaigns.effect_spells import effect_histories

KNOWN = 0.1e-3  # standard deviation of one test's posterior [s]


@pytest.mark.parametrize('scatter', [0.0, 0.1e-3, 0.3e-3])
def test_limits_hold_nineteen_of_twenty_further_estimates(scatter: float) -> None:
    """0.95 of 2000, a standard error of 0.005 (seed fixed).

    Where days do not scatter, half of the histories tell some all the same: up to 0.965.
    """
    rng, inside = np.random.default_rng(5), 0
    for _ in range(2000):
        told = 2e-3 + np.hypot(scatter, KNOWN) * rng.standard_normal(31)
        rows = [
            {
                'day': f'day {i:02d}',
                'effects': 'delay',
                'delay_mean': mean,
                'delay_lower': mean - 1.96 * KNOWN,
                'delay_upper': mean + 1.96 * KNOWN,
            }
            for i, mean in enumerate(told[:30])
        ]
        (effect,) = effect_histories(rows)
        _, _, middle, low, high = effect.sizes[0]
        assert middle == pytest.approx(told[:30].mean())
        inside += low <= told[30] <= high
    assert 0.935 < inside / 2000 < 0.975
