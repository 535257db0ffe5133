"""Signatures that diverged promise nothing, and raise nothing."""

import numpy as np
import pytest

from actuator_glue.diagnosis.refits.screening import Remainder, screen
from actuator_glue.model.parameters import Parameter


@pytest.mark.filterwarnings('error')
@pytest.mark.parametrize('far', [1e7, 1e200, np.inf, np.nan])
def test_what_diverged_promises_nothing(far: float, rng_seed: int) -> None:
    """Beside a size whose signature is all that the residual is."""
    rng = np.random.default_rng(rng_seed)
    error, jacobian = rng.standard_normal(500), rng.standard_normal((4, 500))
    parameters, sizes = [Parameter('size', 'm', 0.0, 10.0, 'size', 0.0)], np.array([[1.0], [2.0]])
    seen = 0.1 * np.stack([error, np.where(np.arange(500) < 400, 0.0, error)])
    seen[1, 400:] = far
    share, best = screen(parameters, sizes, seen, Remainder.of(error, jacobian))
    assert share == pytest.approx(1.0, abs=0.05)
    # Ten times as much is asked for, four times at most.
    assert best[0, 0] == pytest.approx(4.0)
