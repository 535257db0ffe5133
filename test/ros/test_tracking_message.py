"""How the actuator follows its command, after every window of the estimator."""

import numpy as np
import pytest
from actuator_glue_msgs.msg import TrackingIndicators
from ros_nodes import QUICK
from windows import windows_of_a_test


@pytest.mark.slow
def test_one_for_each_window(start, probe):
    """The numbers of its window; their limits in order, and about the measured ones."""
    estimator = start('estimator', **QUICK, tracking_frequencies=[2.0, 5.0])
    found = []
    probe.create_subscription(TrackingIndicators, 'tracking', found.append, 10)
    for posterior, message in windows_of_a_test(start, probe, found):
        assert message.header.stamp == posterior.header.stamp
        assert list(message.frequency) == [2.0, 5.0]
        assert (np.array(message.delay_lower) <= message.delay_upper).all()
        assert 0.0 < message.bandwidth_lower <= message.bandwidth_median
        for name in ('fei_amplitude', 'fei_delay', 'j1', 'j2', 'j3', 'ti', 'hsem'):
            low, middle, high = (
                getattr(message, f'{name}_{of}') for of in ('lower', 'median', 'upper')
            )
            assert low <= middle <= high
        for name in ('fei_amplitude', 'fei_delay', 'j2'):
            seen = getattr(message, f'{name}_measured')
            assert abs(getattr(message, f'{name}_median') - seen) < 0.05 * abs(seen)
    assert estimator.end() == 0
