"""One cause that passes for two names is described as one; two causes stay two names."""

import pytest
from smooth_machines import piston
from two_sweeps import RATE, THETA, motions, selected_of, sweep

from actuator_glue.diagnosis.moves import learned_terms

PLAY, LAG = 60e-6, 8e-3
NAMES = ('backlash', 'sensor-lag', 'gain', 'viscous-damping', 'bias')


@pytest.mark.slow
def test_lost_motion_of_the_command_is_one_cause() -> None:
    """It moves the piston as play and a lag of the transducer do, nearly."""
    u = sweep(2e-3, 9.0, 24.0)
    machine = [(k, u, piston(u, 1.0 / RATE, THETA, k, (6, PLAY))) for k in (0.0, 250e3)]
    beam, found = selected_of(NAMES, machine)
    assert len(found.final.effects) > 1, 'names must explain it by more than one'
    one = learned_terms.with_terms(beam, found)
    assert one is not None
    assert one.final.effects == ('learned-command-play',)
    assert one.final.fit.theta[4] == pytest.approx(PLAY, rel=0.1)


@pytest.mark.slow
def test_two_causes_stay_two_names() -> None:
    """Play and a lag of the transducer: no term explains both."""
    effects = {'backlash': PLAY, 'sensor-lag': LAG}
    machine = motions(effects, THETA, sweep(2e-3, 9.0, 24.0), (0.0, 250e3))
    beam, found = selected_of(NAMES, machine)
    assert set(found.final.effects) == {'backlash', 'sensor-lag'}
    assert learned_terms.with_terms(beam, found) is None
