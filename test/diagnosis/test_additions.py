"""Which refits of further effects are finished."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from actuator_glue.diagnosis.refits.refits import Refits
from actuator_glue.diagnosis.trial import Trial
from actuator_glue.inference.least_squares.each import Each
from actuator_glue.inference.least_squares.fit import Fit
from actuator_glue.model.structure import Structure

# Score [nats] and error [um] of each refit before it is finished.
ROUGH = {
    'drift': (-100.0, 67.0),
    'backlash': (-101.0, 67.0),
    'delay': (-102.0, 67.0),
    'gain': (-103.0, 67.0),
    'bias': (-104.0, 67.0),
    'flow-saturation': (-900.0, 24.0),
    'command-rate': (-950.0, 60.0),
}


def promising(shares: Mapping[str, float]) -> Any:
    """Return what promises these shares of the squared error, whatever the structure."""
    return SimpleNamespace(share=lambda current, name, least=0.0: shares[name])


def trial(name: str, score: float, error: float) -> Trial:
    """Return a refit with this score and error."""
    fit: Any = SimpleNamespace(error=np.full(4, 1e-6 * error))
    return Trial(Structure((name,)), name, fit, np.array([score]))


@pytest.mark.parametrize('seed', range(3))
def test_a_refit_that_leaves_far_less_is_finished_whatever_its_score(seed: int) -> None:
    """Short of its optimum its score was the worst: a saturated valve went without its name."""
    finished = []

    class Rough(Refits):
        def add(
            self, current: Trial, name: str, each: Each = map, *, briefly: bool = False
        ) -> Trial:
            return trial(name, *ROUGH[name])

        def polish(self, found: Trial, valves: bool = True) -> Trial:
            finished.append(found.added)
            return trial(found.added, -10.0, 8.0) if found.added == 'flow-saturation' else found

    names = tuple(np.random.default_rng(seed).permutation(list(ROUGH)))
    data: Any = None
    found = Rough(data, names, _promises=promising(dict.fromkeys(names, 0.5))).additions(
        trial('hum', -100.0, 67.0)
    )
    assert found[0].added == 'flow-saturation'
    assert 'command-rate' not in finished
    assert sorted(t.added for t in found) == sorted(ROUGH)


def test_what_promises_far_less_than_another_is_left_out_or_listed_after_one_step() -> None:
    """Of 40 single effects most promise next to nothing: their refits took half of the time."""
    promised = {'drift': 0.6, 'backlash': 0.2, 'delay': 0.09, 'gain': 0.0}
    asked = dict[str, bool]()

    class Promising(Refits):
        def add(
            self, current: Trial, name: str, each: Each = map, *, briefly: bool = False
        ) -> Trial:
            asked[name] = briefly
            return trial(name, -100.0, 60.0)

        def polish(self, found: Trial, valves: bool = True) -> Trial:
            return found

    data: Any = None
    base = trial('hum', -100.0, 67.0)
    refits = Promising(data, tuple(promised), _promises=promising(promised))
    refits.additions(base)
    assert asked == {'drift': False, 'backlash': False, 'delay': True, 'gain': True}
    asked.clear()
    refits.additions(base, refits.names)
    assert asked == {'drift': False, 'backlash': False}


@pytest.mark.parametrize(('remains', 'refitted'), [(0.9, ['drift', 'gain']), (0.2, [])])
def test_where_no_signature_promises_any_of_much_structure_each_is_refitted(
    remains: float, refitted: list[str]
) -> None:
    """A gain of one record alone bends Eq. (2) so far that signatures promise nothing."""
    asked = list[str]()

    class Silent(Refits):
        def _structure(self, fit: Fit) -> float:
            return remains

        def add(
            self, current: Trial, name: str, each: Each = map, *, briefly: bool = False
        ) -> Trial:
            asked.append(name)
            return trial(name, -100.0, 66.0)

        def polish(self, found: Trial, valves: bool = True) -> Trial:
            return found

    data: Any = None
    base = trial('hum', -100.0, 67.0)
    refits = Silent(data, ('drift', 'gain'), _promises=promising({'drift': 1e-3, 'gain': 1e-3}))
    refits.additions(base, refits.names, below=0.9 * base.mean_square)
    assert sorted(set(asked)) == refitted
