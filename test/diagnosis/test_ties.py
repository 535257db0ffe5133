"""Intervals hold what tied names of others, and the allowance itself, leave open."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from actuator_glue.diagnosis.finding import Rival
from actuator_glue.diagnosis.posterior import mixed_draws, posterior
from actuator_glue.diagnosis.posterior.identifiable import Working
from actuator_glue.diagnosis.search import ties
from actuator_glue.inference.least_squares.space import Space
from actuator_glue.model import commands
from actuator_glue.model.structure import Structure
from actuator_glue.records import Record

RATE = 128.0
THETA = np.array([230.0, 1.7e10, 5.3e6, 26.0])


def rival(name: str, tied: bool, probability: float) -> Rival:
    """A rival with its weight."""
    return Rival(name, 0.0, 0.0, 0.0, tied, probability, probability)


def told(own: Any = None) -> Any:
    """A selection: a sensor's lag, a delay tied with it, and play, which is certain."""
    rows = {
        'sensor-lag': (
            rival('sensor-lag', True, 0.6),
            rival('delay', True, 0.3),
            rival('gain', False, 0.01),
        ),
        'backlash': (rival('backlash', True, 0.9),),
    }
    final = SimpleNamespace(effects=('backlash', 'sensor-lag'), own=own)
    return SimpleNamespace(final=final, rivals=rows)


def test_a_tied_name_has_its_odds() -> None:
    """A third of the weight against two; what is not tied has none, nor one record's setting."""
    refits: Any = SimpleNamespace(known=lambda names: names)
    assert ties.tied_structures(refits, told()) == [(('backlash', 'delay'), pytest.approx(0.5))]
    assert ties.tied_structures(refits, told(own='a record')) == []


def test_parameters_are_those_of_all_structures() -> None:
    """Two thirds of the draws are those told, a third the alternative's, as far as it has them."""
    rng = np.random.default_rng(1)
    draws = np.tile([1.0, 1.0, 1.0, 1.0, 7.0, 8.0], (3000, 1))
    names, instead = ('delay', 'backlash'), ('sensor-lag', 'backlash')
    final: Any = SimpleNamespace(model=Structure(names), effects=names)
    other: Any = SimpleNamespace(model=Structure(instead), effects=instead)
    asked = []

    def sample(trial: Any) -> np.ndarray:
        asked.append(trial)
        return np.tile([2.0, 2.0, 2.0, 2.0, 9.0, 3.0], (10, 1))

    alone = mixed_draws.MixedDraws.of(draws, names)
    both = mixed_draws.mixed(alone, final, [(other, 0.5), (final, 1e-6)], sample, rng)
    assert asked == [other]
    mixed = both.points
    assert (np.array(both.structures)[both.which] == instead).all(axis=1).tolist() == (
        mixed[:, 0] == 2.0
    ).tolist()
    (first, large), (second, small) = mixed_draws.shares(both.which, both.structures)
    assert (first, second) == (names, instead)
    assert large + small == 1.0 and small == np.mean(mixed[:, 0] == 2.0)
    assert np.mean(mixed[:, 0] == 2.0) == pytest.approx(1 / 3, abs=0.03)
    assert (mixed[:, :4] == mixed[:, :1]).all()
    assert (mixed[:, 5] == np.where(mixed[:, 0] == 2.0, 3.0, 8.0)).all()  # play is in both
    assert (mixed[:, 4] == 7.0).all()  # the delay is its own
    assert (mixed_draws.mixed(alone, final, [], sample, rng).points == draws).all()


def test_what_an_allowance_moves_is_not_known_better() -> None:
    """An optimum that shapes move by 0.2 of its logarithm: spread by as much; not past a bound."""
    command = commands.sweep(RATE, 10.0, 0.1, 8.0, 2e-3)
    record = Record(command, command, 1 / RATE, stiffness=0.0)
    space = Space(Structure(()), record.duration)
    around, rng = Working(space), np.random.default_rng(2)
    draws = np.tile(THETA, (4000, 1))
    draws[:, 3] = np.exp(space.upper[3])
    move = np.array([0.2, 0.0, -0.1, 0.1])
    out = np.log(posterior._loosened(around, draws, move, rng) / draws)
    assert np.sqrt(np.mean(out**2, axis=0)) == pytest.approx(
        [0.2, 0.0, 0.1, 0.1], rel=0.05, abs=1e-9
    )
    assert np.corrcoef(out[:, 0], out[:, 2])[0, 1] == pytest.approx(-1.0)
    assert out[:, 3].max() <= 1e-9
