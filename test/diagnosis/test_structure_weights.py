"""One weight for every structure: what it leaves against what it costs."""

import math
from dataclasses import replace

import numpy as np
import pytest
from trials import entries, trial

from actuator_glue.diagnosis.score.weights import price
from actuator_glue.diagnosis.search.judge import Judge
from actuator_glue.diagnosis.trial import Trial
from actuator_glue.inference.least_squares.fit import Fit
from actuator_glue.model.effects import CATALOGUE
from actuator_glue.model.structure import Structure


class Left:
    """A search whose structures leave what their fit does."""

    names = tuple(f'effect {i}' for i in range(30))

    def __init__(self) -> None:
        """Have every effect to choose from."""
        self.entries = entries()

    def price(self, structure: Structure) -> float:
        """Return what a structure costs besides its error [nats]."""
        return price(structure, self.entries, len(self.names))

    @property
    def scorer(self) -> 'Left':
        """The one that scores."""
        return self

    def left_out_error(self, fit: Fit) -> float:
        """Return the rms error of blocks left out [m]."""
        return fit.rms


@pytest.fixture
def judge() -> Judge:
    """One to whom 10 um matter."""
    found = Judge(Left())
    found.material = 1e-5
    return found


def test_more_parameters_and_more_choices_cost() -> None:
    """A nat for each parameter; 30 effects to choose from, 435 pairs of them; forms are many."""
    base, delay = (price(Structure(e), CATALOGUE, 30) for e in ((), ('delay',)))
    assert base == 4.0
    assert delay == pytest.approx(5.0 + math.log(30.0))
    two = price(Structure(('delay', 'viscous-damping')), CATALOGUE, 30)
    assert two == pytest.approx(6.0 + math.log(435.0))
    forms = [e for e in entries().values() if e.name.startswith('learned')]
    term = Structure([forms[0]])
    assert price(term, entries(), 30) == pytest.approx(len(term.parameters) + math.log(len(forms)))


def test_a_tenth_of_what_matters_costs_four_nats(judge: Judge) -> None:
    """Beside the same number of parameters; the best is behind nothing."""
    best = trial(('delay',), 1e-5)
    left = math.hypot(1e-5, 0.1 * judge.material)
    other = trial(('sensor-lag',), left)
    assert judge.behind(other, best) == pytest.approx(4.0)
    assert judge.behind(best, other) == pytest.approx(-4.0)
    richer = trial(('stribeck-friction',), 1e-5)
    assert judge.behind(richer, trial(('coulomb-friction',), 1e-5)) == pytest.approx(2.0)


def test_equations_for_one_thing_differ_by_a_share_of_what_they_explain(judge: Judge) -> None:
    """Beside 400 um explained 15 um more hardly tell a name; beside 40 um they do."""
    best = trial(('backlash',), 1e-5)
    rival = trial(('coulomb-friction',), math.hypot(1e-5, 1.5e-5))
    many, few = (trial((), math.hypot(1e-5, size)) for size in (4e-4, 4e-5))
    (share, none), (apart, _) = (judge.odds(rest, best, [rival]) for rest in (many, few))
    assert share > 0.1 > 1e-3 > apart
    assert none == 0.0


def test_what_fits_better_by_chance_is_no_more_likely_than_what_is_told(judge: Judge) -> None:
    """A rival that the search did not go on to has half the weight at most."""
    best, ahead = trial(('delay',), 1.1e-5), trial(('sensor-lag',), 1e-5)
    assert judge.odds(trial((), 1e-4), best, [ahead])[0] == 1.0


def test_a_structure_that_diverges_has_no_weight(judge: Judge) -> None:
    """Its error is no number."""
    best = trial(('delay',), 1e-5)
    lost = replace(best, fit=replace(best.fit, error=np.full_like(best.fit.error, np.inf)))
    assert isinstance(lost, Trial)
    assert judge.odds(trial((), 1e-4), best, [lost])[0] == 0.0


@pytest.mark.parametrize(
    ('named', 'term', 'told'),
    [(0.4, 0.0, 'name'), (0.6, 0.0, 'term'), (3.0, 2.99, 'name'), (4.0, 2.0, 'term')],
)
def test_a_description_takes_the_place_of_a_name_where_that_matters(
    judge: Judge, named: float, term: float, told: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Errors in units of what matters; another name is told by a tenth of that."""
    monkeypatch.setattr(judge, 'left', lambda t: math.sqrt(t.fit.rms**2 - 1e-10))
    sizes = [math.hypot(1e-5, share * judge.material) for share in (named, term)]
    name, other = trial(('flow-asymmetry',), sizes[0]), trial(('gain',), sizes[1])
    described = trial(('learned-valve-e2',), sizes[1])
    assert judge.heaviest([name, described]) is (name if told == 'name' else described)
    if term == 0.0:
        assert judge.heaviest([name, other]) is other


def test_another_shape_of_a_named_cause_is_no_description(judge: Judge) -> None:
    """It is told from the name as names are from each other."""
    name = trial(('coulomb-friction',), math.hypot(1e-5, 0.2 * judge.material))
    shape = trial(('learned-force-friction',), 1e-5)
    assert judge.behind(shape, name) < -10.0
