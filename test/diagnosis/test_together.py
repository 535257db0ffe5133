"""Two effects of which each hides the other are found though neither alone matters."""

import numpy as np
import pytest

from actuator_glue.diagnosis import together
from actuator_glue.diagnosis.data import Data
from actuator_glue.diagnosis.model_selection import ModelSelection
from actuator_glue.diagnosis.ranking import removed
from actuator_glue.diagnosis.search import Search
from actuator_glue.diagnosis.selection import Selection
from actuator_glue.diagnosis.thresholds import Thresholds
from actuator_glue.model.structure import Structure
from actuator_glue.records import Record

RATE = 128.0
THETA = np.array([235.0, 5.0e10, 4.23e6, 3.3])
NAMES = ('delay', 'supply-droop', 'viscous-damping', 'gain-drift', 'bias')
DELAY, DROOP = 8e-3, 6.0  # together some 8 um, each alone less than 3


def selected(delay: float, droop: float) -> tuple[ModelSelection, Selection]:
    """Two sweeps with both effects; 10 um of noise."""
    rng = np.random.default_rng()
    model = Structure(('delay', 'supply-droop'))
    t = np.arange(int(30 * RATE)) / RATE
    command = 2.2e-3 * np.sin(np.pi * (8.0 / 30.0) * t**2)
    values = model.neutral(THETA)
    values[model.columns('delay')] = delay
    values[model.columns('supply-droop')] = droop
    records = []
    for k in (100e3, 400e3):
        y = model.simulate(values, Record(command, command, 1 / RATE, stiffness=k))
        y = y + 1e-5 * rng.standard_normal(len(t))
        records.append(Record(command, y, 1 / RATE, stiffness=k))
    selection = ModelSelection(Search(Data.whole(records), NAMES), Thresholds(), lambda s, d: None)
    return selection, selection.run()


def test_two_that_hide_each_other_are_found() -> None:
    """Of 25 machines 0.76 to 0.85 of the noise was left; alone half of what matters goes."""
    selection, found = selected(DELAY, DROOP)
    assert found.final.effects == ()
    assert found.left > Thresholds().left_noise * found.noise
    assert all(removed(found.base, t) < found.material for t in found.singles)
    chosen = together.explained(selection, found)
    assert chosen is not None
    assert chosen.final.effects == ('delay', 'supply-droop')
    assert chosen.left < chosen.material
    # Noise is left: four standard deviations of the rms of 7680 samples, and a few fitted.
    assert chosen.final.fit.rms == pytest.approx(1e-5, rel=0.035)


def test_one_alone_is_no_pair() -> None:
    """A quarter of the delay makes less than matters: nothing is added, nor beside it."""
    selection, found = selected(0.25 * DELAY, 0.0)
    assert found.final.effects == ()
    assert together.explained(selection, found) is None


def test_a_member_that_matters_alone_needs_more() -> None:
    """What does not complete an answer must remove all that matters."""
    selection, found = selected(DELAY, DROOP)
    search = selection.search
    base, delay = search.trial(()), search.additions(found.base, ['delay'])[0]
    both = search.additions(delay, ['supply-droop'])[0]
    assert selection.least(both, delay) == selection.part() < selection.material
    assert selection.least(delay, base) == selection.material
