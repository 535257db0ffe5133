"""What no catalogue holds may be the largest effect; names come beside it then."""

import numpy as np
import pytest
from two_sweeps import RATE, selected_of, sweep

from actuator_glue.model.structure import Structure
from actuator_glue.records import Record

NAMES = ('gain', 'gain-drift', 'payload-inertia', 'sensor-lag', 'backlash', 'bias')
THETA = np.array([230.0, 3.5e9, 4e5, 0.6])
RATE_GAIN, LAG = 2.7, 6e-3


@pytest.mark.slow
def test_a_name_is_found_beside_a_description() -> None:
    """A lag beside a command that grows with its rate: names make up for both, and for neither."""
    u = sweep(2e-3, 8.0, 32.0)
    given = u * (1.0 + RATE_GAIN * RATE * np.abs(np.diff(u, prepend=0.0)))
    model, theta, machine = Structure(('sensor-lag',)), np.append(THETA, LAG), []
    for k in (0.0, 250e3):
        machine.append((k, u, model.simulate(theta, Record(given, given, 1.0 / RATE, k))))
    _, found = selected_of(NAMES, machine)
    assert found.final.effects == ('sensor-lag', 'learned-command-u-absr')
    assert found.left < found.material
    lag, size = found.final.fit.theta[4:]
    assert lag == pytest.approx(LAG, rel=0.05)
    assert size == pytest.approx(RATE_GAIN, rel=0.05)
