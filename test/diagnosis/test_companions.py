"""Effects below what matters are not told, but sizes beside them are right."""

import re
from dataclasses import replace

import numpy as np
import pytest
import two_sweeps

from actuator_glue.diagnosis.moves.taken_for_noise import taken_for_noise
from actuator_glue.diagnosis.posterior import answer_posterior, discrepancy, mixed_draws, posterior
from actuator_glue.diagnosis.posterior.posterior import Draws
from actuator_glue.diagnosis.search import companions
from actuator_glue.diagnosis.search.beam_search import BeamSearch
from actuator_glue.diagnosis.selection import Selection
from actuator_glue.diagnosis.telling import companion_notes
from actuator_glue.diagnosis.trial import Trial
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.records import Record

NAMES = ('viscous-damping', 'specimen-gap', 'valve-deadband', 'bias', 'delay', 'drift')
# The gap removes 1.7 um, 0.1 um from one draw of the noise to the next: between the 1 um that
# is looked for and the 5 um that matter.
DAMPING, GAP = 5e4, 9e-5


def selected(gap: float, seed: int = 1) -> tuple[BeamSearch, Selection]:
    """Two sweeps with damping and perhaps a gap at the specimen; 10 um of noise."""
    effects = {'viscous-damping': DAMPING, 'specimen-gap': gap}
    return two_sweeps.selected(NAMES, effects, 2e-3, 10.0, 40.0, seed)


@pytest.fixture(scope='module')
def without_gap() -> list[tuple[BeamSearch, Selection]]:
    """Four machines with damping alone."""
    return [selected(0.0, seed) for seed in range(4)]


def sampled(beam: BeamSearch, found: Selection, trial: Trial) -> Draws:
    """Normal approximation of a structure's posterior."""
    scorer = beam.refits.scorer
    assert scorer is not None
    small = discrepancy.responses(beam.refits, found.material)
    return posterior.sample(
        trial.structure,
        trial.fit,
        scorer,
        beside=discrepancy.beside(small, trial.effects, scorer),
        rng=np.random.default_rng(1),
        evaluations=0,
        progress=lambda share: None,
    )


def test_what_does_not_matter_is_held_beside() -> None:
    """A gap that removes less than half of the noise: not told, and the damping is right."""
    beam, found = selected(GAP)
    assert found.final.effects == ('viscous-damping',)
    larger = companions.with_companions(beam, found.final)
    assert larger.effects == ('viscous-damping', 'specimen-gap')
    draws = answer_posterior.reduced(
        sampled(beam, found, larger), larger, found.final, [True] * 4 + [False]
    )
    assert draws.widening == (1.0, 1.0, 1.0, 1.0, np.inf)  # what is open stays open
    assert draws.points.shape[1] == 5
    # Five standard deviations of the estimate: fails by chance once in 10^6.
    low, high = np.quantile(draws.points[:, 4], [0.025, 0.975])
    assert abs(0.5 * (low + high) - DAMPING) < 5.0 * (high - low) / 3.92
    held = beam.refits.data  # what it leaves there is known
    (sentence,) = companion_notes.sentences(found.final, larger, held, missed=False)
    assert sentence.startswith('specimen-gap may be there, too')
    assert sentence.endswith('less than what matters; intervals allow for it')
    (sentence,) = companion_notes.sentences(found.final, larger, held, missed=True)
    left = 1e6 * larger.fit.rms, 1e6 * found.final.fit.rms
    assert sentence.endswith('leaves {:.1f} um with it, {:.1f} um without'.format(*left))


def test_one_of_a_kind_stands_for_what_is_like_it(rng_seed: int) -> None:
    """Which lag of 1 ms it is nobody knows, but without any beta_1 is a sixth less.

    With a lag of the valve it is, too: of 120 noises that came first for ten, and then what is
    like it widens the interval.
    """
    names = ('delay', 'valve-lag', 'sensor-lag', 'viscous-damping', 'bias', 'drift')
    u = two_sweeps.sweep(2e-3, 10.0, 40.0)
    tests = two_sweeps.motions({'sensor-lag': 1e-3}, two_sweeps.THETA, u, (100e3, 400e3))
    beam, found = two_sweeps.selected_of(names, tests, rng_seed)
    assert not found.final.effects
    larger = companions.with_companions(beam, found.final)
    assert set(larger.effects) & set(names[:3])
    like = companions.alike(beam, found.final, larger)
    assert {e for trial, _ in like for e in trial.effects} | set(larger.effects) == set(names[:3])

    def draws(trial: Trial) -> np.ndarray:
        return sampled(beam, found, trial).points

    rng = np.random.default_rng(rng_seed)
    alone = mixed_draws.MixedDraws.of(draws(larger), larger.effects)
    both = mixed_draws.mixed(alone, larger, like, draws, rng).points
    without, beside = (
        np.quantile(points[:, 0], [0.025, 0.5, 0.975]) for points in (draws(found.final), both)
    )
    true = two_sweeps.THETA[0]
    # Five standard deviations of the estimate: fails by chance once in 10^6.
    assert abs(beside[1] - true) < 5.0 * (beside[2] - beside[0]) / 3.92
    assert without[2] < 0.93 * true
    held = beam.refits.data
    (sentence,) = companion_notes.sentences(found.final, larger, held, missed=False)
    assert sentence.startswith(f'{larger.effects[-1]} (or what is like it) may be there, too')


def test_what_removes_what_matters_is_added() -> None:
    """Though the rest passed for noise: where 1 um mattered the gap's 1.7 um would."""
    beam, found = selected(GAP)
    assert taken_for_noise(beam, found) is None
    beam.material = 1e-6
    larger = taken_for_noise(beam, found)
    assert larger is not None
    assert larger.final.effects == ('viscous-damping', 'specimen-gap')
    assert set(larger.rivals) == set(larger.final.effects)


def test_nothing_is_held_beside_without_it(
    without_gap: list[tuple[BeamSearch, Selection]],
) -> None:
    """At the level of false alarms, one in a hundred."""
    held = []
    for beam, found in without_gap:
        assert found.final.effects == ('viscous-damping',)
        larger = companions.with_companions(beam, found.final)
        assert companion_notes.sentences(larger, larger, beam.refits.data, True) == ()
        held.append(larger is not found.final)
    assert not any(held)


def test_what_has_a_record_of_its_own_stands_alone(
    without_gap: list[tuple[BeamSearch, Selection]],
) -> None:
    """One record's setting is no effect of the catalogue's search."""
    beam, found = without_gap[0]
    own = replace(found.final, own=found.final.structure)
    assert companions.with_companions(beam, own) is own


def test_damping_is_found_on_either_side_of_the_valve(
    without_gap: list[tuple[BeamSearch, Selection]],
) -> None:
    """Beside Eq. (2)'s slow valve there is a second minimum, of half the damping.

    Of 24 such machines 10 ended there, with 3000 nats less, and none from wider valves.
    """
    for _, found in without_gap:
        final = found.final
        assert final.fit.theta[0] == pytest.approx(two_sweeps.THETA[0], rel=0.1)
        assert final.fit.theta[4] == pytest.approx(DAMPING, rel=0.1)


def test_what_the_held_out_part_shows_is_hinted_at(rng_seed: int) -> None:
    """Damping that is seen but does not matter in small sweeps, of another kind than delays.

    It removes 2.7 um there, and tenfold in a test of ten times the stroke, of which 1.4 to 2.6 um
    are left. False failures: none in 30 runs (95 % interval 0 to 12 %).
    """
    names, small = ('viscous-damping', 'delay', 'bias', 'drift'), 2e-4
    u, theta = two_sweeps.sweep(small, 10.0, 80.0), two_sweeps.THETA
    effects, stiffness = {'viscous-damping': 3e4}, (100e3, 400e3)
    beam, found = two_sweeps.selected_of(
        names, two_sweeps.motions(effects, theta, u, stiffness), rng_seed
    )
    assert not found.final.effects
    loud = [
        Record(v, y, 1 / two_sweeps.RATE, stiffness=k)
        for k, v, y in two_sweeps.motions(effects, theta, 10.0 * u, stiffness)
    ]
    (sentence,) = companion_notes.hint(beam, found.final, Data.whole(loud))
    assert sentence.startswith('viscous-damping (or what is like it) is not added')
    left = re.findall(r'([\d.]+) um with', sentence)
    assert float(left[0]) < 0.5 * float(left[1])
    assert companion_notes.hint(beam, found.final, beam.refits.data) == ()
