"""Two names take the place of one that seems enough, where what is beside it tells."""

import numpy as np
import pytest
from two_sweeps import motions, selected_of, sweep

from actuator_glue.diagnosis.moves import two_for_one

NAMES = ('gain-drift', 'clock-skew', 'valve-lag', 'gain', 'bias', 'supply-droop')
THETA = np.array([85.0, 2.5e10, 4.7e6, 4.2])
LAG, SKEW = 2.6e-3, -6e-5
STIFFNESSES = (100e3, 400e3)


def test_two_take_the_place_of_a_name_that_seems_enough() -> None:
    """A slow valve and a clock that runs fast leave next to nothing as a gain that drifts."""
    effects = {'valve-lag': LAG, 'clock-skew': SKEW}
    machine = motions(effects, THETA, sweep(2e-3, 8.0, 40.0), STIFFNESSES)
    beam, found = selected_of(NAMES, machine)
    assert found.final.effects == ('gain-drift',)
    assert found.left < found.material
    told = two_for_one.exchanged(beam, found)
    assert told is not None
    assert told.final.effects == ('valve-lag', 'clock-skew')
    assert told.final.fit.theta[4:] == pytest.approx([LAG, SKEW], rel=0.1)


def test_a_right_name_is_not_exchanged() -> None:
    """No two others say more than a gain that drifts where it does."""
    machine = motions({'gain-drift': 0.05}, THETA, sweep(2e-3, 8.0, 40.0), STIFFNESSES)
    beam, found = selected_of(NAMES, machine)
    assert found.final.effects == ('gain-drift',)
    assert two_for_one.exchanged(beam, found) is None
