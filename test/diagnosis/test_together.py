"""Two effects of which each hides the other are found though neither alone matters."""

import pytest
import two_sweeps

from actuator_glue.diagnosis.moves import two_effects
from actuator_glue.diagnosis.search.beam_search import BeamSearch
from actuator_glue.diagnosis.selection import Selection
from actuator_glue.diagnosis.thresholds import LEFT_NOISE
from actuator_glue.diagnosis.trial import removed

NAMES = ('delay', 'supply-droop', 'viscous-damping', 'gain-drift', 'bias')
DELAY, DROOP = 8e-3, 6.0  # together some 8 um, each alone less than 3


def selected(
    delay: float, droop: float, names: tuple[str, ...] = NAMES
) -> tuple[BeamSearch, Selection]:
    """Two sweeps with both effects; 10 um of noise."""
    effects = {'delay': delay, 'supply-droop': droop}
    return two_sweeps.selected(names, effects, stroke=2.2e-3, hertz=8.0, seconds=30.0)


@pytest.mark.slow
def test_two_that_hide_each_other_are_found() -> None:
    """Of 25 machines 0.76 to 0.85 of the noise was left; alone half of what matters goes."""
    beam, found = selected(DELAY, DROOP)
    assert found.final.effects == ()
    assert found.left > LEFT_NOISE * found.noise
    assert all(removed(found.base, t) < found.material for t in found.singles)
    chosen = two_effects.explained(beam, found)
    assert chosen is not None
    assert chosen.final.effects == ('delay', 'supply-droop')
    assert chosen.left < chosen.material
    # Noise is left: four standard deviations of the rms of 7680 samples, and a few fitted.
    assert chosen.final.fit.rms == pytest.approx(1e-5, rel=0.035)


def test_one_alone_is_no_pair() -> None:
    """A quarter of the delay makes less than matters: nothing is added, nor beside it."""
    beam, found = selected(0.25 * DELAY, 0.0)
    assert found.final.effects == ()
    assert two_effects.explained(beam, found) is None


@pytest.mark.slow
def test_a_member_that_matters_alone_needs_more() -> None:
    """What does not complete an answer must remove all that matters."""
    beam, found = selected(DELAY, DROOP, ('delay', 'supply-droop'))
    refits = beam.refits
    base, delay = refits.trial(()), refits.additions(found.base, ['delay'])[0]
    both = refits.additions(delay, ['supply-droop'])[0]
    assert beam.least(both, delay) == beam.part() < beam.material
    assert beam.least(delay, base) == beam.material
