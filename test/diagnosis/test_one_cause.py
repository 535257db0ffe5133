"""One cause that passes for two names is described as one; two causes stay two names."""

import numpy as np
import pytest
from smooth_machines import piston

from actuator_glue.diagnosis import learning
from actuator_glue.diagnosis.data import Data
from actuator_glue.diagnosis.model_selection import ModelSelection
from actuator_glue.diagnosis.search import Search
from actuator_glue.diagnosis.selection import Selection
from actuator_glue.diagnosis.thresholds import Thresholds
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array, Record

RATE, SECONDS, NOISE, PLAY, LAG = 128.0, 24.0, 1e-5, 60e-6, 8e-3
THETA = np.array([235.0, 5e10, 4.23e6, 3.3])
NAMES = ('backlash', 'sensor-lag', 'gain', 'viscous-damping', 'bias')


def selected(motions: list[tuple[float, Array, Array]]) -> tuple[ModelSelection, Selection]:
    """What names say of stiffness, command and displacement of each test, noise added."""
    rng = np.random.default_rng()
    records = [
        Record(u, y + NOISE * rng.standard_normal(len(y)), 1.0 / RATE, stiffness=k)
        for k, u, y in motions
    ]
    selection = ModelSelection(Search(Data.whole(records), NAMES), Thresholds(), lambda *_: None)
    return selection, selection.run()


def sweep() -> Array:
    """2 mm to 9 Hz [m]."""
    t = np.arange(0.0, SECONDS, 1.0 / RATE)
    return np.asarray(2e-3 * np.sin(np.pi * (9.0 / SECONDS) * t**2))


def test_lost_motion_of_the_command_is_one_cause() -> None:
    """It moves the piston as play and a lag of the transducer do, nearly."""
    u = sweep()
    machine = [(k, u, piston(u, 1.0 / RATE, THETA, k, (6, PLAY))) for k in (0.0, 250e3)]
    selection, found = selected(machine)
    assert len(found.final.effects) > 1, 'names must explain it by more than one'
    one = learning.instead(selection, found)
    assert one is not None
    assert one.final.effects == ('learned-command-play',)
    assert one.final.fit.theta[4] == pytest.approx(PLAY, rel=0.1)


def test_two_causes_stay_two_names() -> None:
    """Play and a lag of the transducer: no term explains both."""
    u, model = sweep(), Structure(('backlash', 'sensor-lag'))
    values = model.neutral(THETA)
    values[model.columns('backlash')], values[model.columns('sensor-lag')] = PLAY, LAG
    machine = [
        (k, u, model.simulate(values, Record(u, u, 1.0 / RATE, stiffness=k))) for k in (0.0, 250e3)
    ]
    selection, found = selected(machine)
    assert set(found.final.effects) == {'backlash', 'sensor-lag'}
    assert learning.instead(selection, found) is None
