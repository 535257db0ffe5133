"""One effect that was found may stand for two of the catalogue together."""

import numpy as np
import pytest

from actuator_glue.diagnosis.refits.refits import Refits
from actuator_glue.diagnosis.search.beam_search import BeamSearch
from actuator_glue.diagnosis.selection import Selection
from actuator_glue.diagnosis.thresholds import Thresholds
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.model import commands
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array, Record

RATE = 128.0
THETA = np.array([235.0, 5.0e10, 4.23e6, 3.3])
NAMES = ('payload-inertia', 'viscous-damping', 'delay', 'gain')


def selected(
    effects: tuple[str, ...], sizes: list[float], rng_seed: int, base: Array = THETA
) -> Selection:
    """What is chosen of four effects for sweeps without and with a specimen, 10 um of noise."""
    model, rng, records = Structure(effects), np.random.default_rng(rng_seed), []
    command = commands.sweep(RATE, 24.0, 0.0, 10.0, 2e-3)
    theta = np.array([*base, *sizes])
    for k in (0.0, 250e3):
        measured = model.simulate(theta, Record(command, command, 1 / RATE, stiffness=k))
        measured += 1e-5 * rng.standard_normal(len(command))
        records.append(Record(command, measured, 1 / RATE, stiffness=k))
    refits = Refits(Data.whole(records), NAMES)
    return BeamSearch(refits, Thresholds(), lambda stage, share: None).run()


def test_damping_and_a_delay_are_as_likely_as_the_payload_that_does_the_same(
    rng_seed: int,
) -> None:
    """A payload has a damping of its own; without pairs among its rivals it was certain."""
    found = selected(('viscous-damping', 'delay'), [2.5e4, 3e-3], rng_seed)
    if found.final.effects == ('payload-inertia',):
        row = found.rivals['payload-inertia']
        both = [r.probability for r in row if set(r.effects) == {'viscous-damping', 'delay'}]
        assert both[0] > 0.05
        assert next(r.probability for r in row if r.name == 'payload-inertia') < 0.9
    else:
        assert set(found.final.effects) == {'viscous-damping', 'delay'}


@pytest.mark.parametrize('known_seed', [None, 413946191])
def test_two_that_remove_what_matters_take_the_place_of_the_one_that_is_tied(
    known_seed: int | None, rng_seed: int
) -> None:
    """A payload leaves 5.5 um of what a delay and damping make, a tenth of what it removes.

    That is as good as the same error, and left nothing material by its spectrum. With the known
    seed the payload is ahead of damping by one block alone: each took the other's place in turn.
    """
    base, seed = np.array([206.0, 6.33e10, 3.97e6, 3.2]), known_seed or rng_seed
    found = selected(('delay', 'viscous-damping'), [8.05e-3, 3.6e4], seed, base)
    assert set(found.final.effects) == {'viscous-damping', 'delay'}


def test_a_payload_keeps_its_name(rng_seed: int) -> None:
    """Two effects together leave 17 um more than what it is."""
    found = selected(('payload-inertia',), [200.0, 100.0], rng_seed)
    assert found.final.effects == ('payload-inertia',)
    told = {r.name: r.probability for r in found.rivals['payload-inertia']}
    assert told['payload-inertia'] > 0.99
    assert any(len(r.effects) == 2 for r in found.rivals['payload-inertia'])
