"""What the records cannot tell apart speaks by the simplest, and by names."""

from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from trials import ENTRIES, THETA, trial

from actuator_glue.diagnosis import simplest
from actuator_glue.diagnosis.finding import Rival
from actuator_glue.diagnosis.model_selection import ModelSelection
from actuator_glue.diagnosis.thresholds import Thresholds
from actuator_glue.diagnosis.trial import Trial
from actuator_glue.inference.least_squares.fit import Fit
from actuator_glue.model.effects import CATALOGUE, Effect
from actuator_glue.model.structure import Structure


@dataclass
class Tried:
    """A search that knows some structures."""

    trials: dict[tuple[str, ...], Trial]
    entries: dict[str, Effect] = field(default_factory=lambda: dict(CATALOGUE))

    def trial(self, effects: tuple[str, ...], added: str = '') -> Trial:
        """Return the structure."""
        return replace(self.trials[effects], added=added)

    def without(self, trial: Trial, name: str) -> Trial:
        """Return the structure without one of its effects."""
        return self.trials[tuple(n for n in trial.effects if n != name)]


@pytest.mark.parametrize(
    ('force', 'ratio', 'speed', 'name'),
    [
        (80.0, 4.0, 0.016, 'coulomb-friction'),
        (80.0, 1.5, 0.1, 'coulomb-friction'),
        (80.0, 1.8, 0.005, 'stribeck-friction'),
        (8.0, 1.8, 0.005, 'stribeck-friction'),
    ],
)
def test_a_richer_form_at_its_bound_mends_the_other(
    force: float, ratio: float, speed: float, name: str
) -> None:
    """Friction that falls by as much as may be, or nowhere, is Coulomb's, 300 nats or not.

    A small force is no bound: below 20 N Stribeck friction was never told.
    """
    coulomb, stribeck = ('coulomb-friction',), ('stribeck-friction',)
    sizes = {coulomb: [100.0], stribeck: [force, ratio, speed]}
    trials = {
        n: Trial(
            Structure(n),
            n[0],
            Fit(np.append(THETA, s), np.zeros(3), np.zeros((4 + len(s), 3)), np.zeros(4)),
            np.zeros(2),
        )
        for n, s in sizes.items()
    }
    found = ModelSelection(Tried(trials), Thresholds(), lambda stage, share: None)
    rivals = {stribeck[0]: (Rival(coulomb[0], 300.0, 20.0, 1e-6, True, 0.4, 0.4),)}
    assert simplest.instead(found, trials[stribeck], rivals, True).effects == (name,)


def test_a_name_takes_the_place_of_a_description_that_it_is_tied_with() -> None:
    """Though neither is simpler; not one that leaves materially more, or is not tied."""
    names = ('learned-valve-e2',), ('flow-asymmetry',)
    tried = Tried({n: trial(n, 1e-5) for n in names}, ENTRIES)
    found = ModelSelection(tried, Thresholds(), lambda stage, share: None)
    found.material = 3e-6
    own = Rival('learned-valve-e2', 0.0, 0.0, 0.0, True, 0.7, 0.7)
    cases = (True, 1e-6, names[1]), (True, 4e-6, names[0]), (False, 1e-6, names[0])
    for tied, excess, chosen in cases:
        row = own, Rival('flow-asymmetry', 60.0, 40.0, excess, tied, 0.2, 0.2)
        simpler = simplest.instead(found, tried.trials[names[0]], {'learned-valve-e2': row}, True)
        assert simpler.effects == chosen


def test_two_names_take_the_place_of_a_description_where_each_is_worth_it() -> None:
    """A lag and damping were a resonance of the command with four parameters."""
    form, two = 'learned-command-resonance', ('sensor-lag', 'viscous-damping')
    structures = [(form,), two, two[:1], two[1:]]
    row = (
        Rival(form, 0.0, 0.0, 0.0, True, 0.3, 0.3),
        Rival(' + '.join(two), 0.0, 0.0, 0.0, True, 0.4, 0.4),
    )
    for worth, chosen in ((30.0, two), (3.0, (form,))):
        trials = {n: trial(n, 1e-5 if len(n) > 1 or n == (form,) else 2e-5) for n in structures}
        for name in two:
            trials[(name,)] = replace(trials[(name,)], scores=np.full(2, -worth))
        found = ModelSelection(Tried(trials, ENTRIES), Thresholds(), lambda stage, share: None)
        found.material = 3e-6
        assert simplest.instead(found, trials[(form,)], {form: row}, True).effects == chosen
