"""What was found goes on to the same samples, cleaned otherwise, whatever effort is left."""

import numpy as np
import pytest
from two_sweeps import NOISE, RATE, THETA, motions, sweep

from actuator_glue.diagnosis.effort import Effort
from actuator_glue.diagnosis.refits.refits import Refits
from actuator_glue.diagnosis.search.beam_search import BeamSearch
from actuator_glue.diagnosis.selection import Selection
from actuator_glue.diagnosis.thresholds import Thresholds
from actuator_glue.diagnosis.trial import Trial
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.records import Record

NAMES = ('backlash', 'bias', 'delay', 'flow-asymmetry', 'gain', 'gain-drift')
TRUE = {'backlash': 60e-6, 'gain-drift': 1e-2}


def records(impulses: bool) -> list[Record]:
    """Two sweeps of a machine with play and a gain that drifts; impulses of 0.2 mm or none."""
    rng, out = np.random.default_rng(5), []
    for k, u, y in motions(TRUE, THETA, sweep(2e-3, 6.0, 20.0), (100e3, 400e3)):
        measured = y + NOISE * rng.standard_normal(len(y))
        hit = rng.integers(200, len(y), 3)
        if impulses:
            measured[hit] += 2e-4
        out.append(Record(u, measured, 1 / RATE, k))
    return out


def searching(data: Data, effort: Effort) -> BeamSearch:
    """A search that has not begun."""
    return BeamSearch(Refits(data, NAMES, effort=effort), Thresholds(), lambda stage, share: None)


@pytest.fixture(scope='module')
def before() -> tuple[BeamSearch, Selection]:
    """What was found before the impulses were removed."""
    dirty = searching(Data.whole(records(True)), Effort())
    return dirty, dirty.run()


@pytest.mark.slow
def test_an_answer_is_kept_where_impulses_are_removed_and_no_effort_is_left(
    before: tuple[BeamSearch, Selection],
) -> None:
    """A search from the beginning would end with its first effect."""
    dirty, found = before
    assert set(found.final.effects) == set(TRUE)

    clean = Data.whole(records(False))
    anew = searching(clean, Effort(most=1.0)).run()
    assert set(anew.final.effects) < set(TRUE)

    resumed = searching(clean, Effort(most=1.0))
    kept = resumed.resumed(dirty.refits, found)
    assert set(kept.final.effects) == set(TRUE)
    assert kept.left < kept.material
    assert kept.noise < found.noise
    assert kept.noise == pytest.approx(NOISE, rel=0.05)
    assert [t.effects for t in kept.singles] != []


def test_going_on_costs_less_and_says_the_same(before: tuple[BeamSearch, Selection]) -> None:
    """With effort left, what is found from there is what is found from the beginning."""
    dirty, found = before
    clean = Data.whole(records(False))
    anew = searching(clean, Effort())
    first = anew.run()
    again = searching(clean, Effort())
    then = again.resumed(dirty.refits, found)
    assert set(then.final.effects) == set(first.final.effects) == set(TRUE)
    np.testing.assert_allclose(then.final.fit.rms, first.final.fit.rms, rtol=1e-3)
    assert again.refits.effort.spent < 0.7 * anew.refits.effort.spent


def test_a_learned_term_is_asked_for_where_names_end(monkeypatch: pytest.MonkeyPatch) -> None:
    """Play, of which no name is offered: what one leaves may have a description."""
    asked: list[tuple[str, ...]] = []

    def explained(refits: BeamSearch, current: Trial) -> bool:
        asked.append(current.effects)
        return True

    monkeypatch.setattr(BeamSearch, 'explained_by_term', explained)
    names = ('bias', 'gain', 'gain-drift')
    refits = Refits(Data.whole(records(False)), names)
    found = BeamSearch(refits, Thresholds(), lambda stage, share: None).run()
    assert found.left > found.material
    assert asked == [found.final.effects] and found.described
