"""What tests of hybrid simulation share."""

from collections.abc import Callable

import pytest

import actuator_glue as ag
from studies.hybrid.plants import spread


@pytest.fixture(scope='session')
def benchmark_draws() -> Callable[..., ag.Calibration]:
    """The benchmark's plant and its spread as a posterior: Eq. (2) with three effects is it."""
    return spread
