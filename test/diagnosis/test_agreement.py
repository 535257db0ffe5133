"""Agreement of an effect across the halves of the records, and the generic surrogate."""

from dataclasses import replace

import numpy as np
import pytest

from actuator_glue.diagnosis.posterior.agreement import agreement, between
from actuator_glue.diagnosis.refits.refits import Refits
from actuator_glue.diagnosis.score.scorer import Scorer, splits_of
from actuator_glue.diagnosis.score.surrogate import Surrogate, compare
from actuator_glue.diagnosis.trial import Trial
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array, Record

RATE = 128.0
THETA = np.array([235.0, 5.0e10, 4.23e6, 3.3])
T = np.arange(int(24 * RATE)) / RATE
SWEEP = 2e-3 * np.sin(np.pi * (10.0 / 24.0) * T**2)


def searched(
    effect: str, sizes: tuple[float, float], seed: int, extra: Array | float = 0.0
) -> tuple[Refits, Trial]:
    """Two sweeps with one effect at a size of its own in each, 10 um of noise; base fitted."""
    rng = np.random.default_rng(seed)
    model, records = Structure((effect,)), []
    for size, k in zip(sizes, (0.0, 250e3), strict=True):
        y = model.simulate(np.append(THETA, size), Record(SWEEP, SWEEP, 1 / RATE, stiffness=k))
        y = y + extra + 1e-5 * rng.standard_normal(len(T))
        records.append(Record(SWEEP, y, 1 / RATE, stiffness=k))
    refits = Refits(Data.whole(records), (effect,))
    base = refits.base()
    refits.scorer = Scorer.of(refits.data, splits_of(refits.data, base.error))
    return refits, refits.additions(refits.trial(()))[0]


def scorer_of(refits: Refits, trial: Trial) -> Scorer:
    """Blocks and whitening by what the structure leaves."""
    return Scorer.of(refits.data, splits_of(refits.data, trial.fit.error))


@pytest.mark.parametrize('seed', [31, 32, 33])
def test_one_size_agrees(seed: int) -> None:
    """Equal play in both tests: four halves, one size (chance of failure below 1 % each)."""
    refits, trial = searched('backlash', (6e-5, 6e-5), seed)
    found = agreement(trial, scorer_of(refits, trial))['backlash']
    assert found.agree is True
    assert len(found.values) == 4
    assert found.values == pytest.approx([6e-5] * 4, abs=1e-5)


def test_two_sizes_do_not_agree() -> None:
    """Play of 30 um in one test and 120 um in the other: seen, with the sizes in order."""
    refits, trial = searched('backlash', (3e-5, 12e-5), 34)
    found = agreement(trial, scorer_of(refits, trial))['backlash']
    assert found.agree is False
    assert found.p_value < 0.01
    assert max(found.values[:2]) < min(found.values[2:])


def test_how_far_stretches_differ_is_in_every_parameter_s_unit() -> None:
    """Play of 30 and 120 um: 52 um of standard deviation over four halves, half of it beside.

    Of equal play nothing beyond what noise makes: at most three standard errors of a half.
    """
    refits, trial = searched('backlash', (3e-5, 12e-5), 36)
    apart = between(trial, scorer_of(refits, trial))
    assert 25e-6 < apart[4] < 80e-6
    refits, trial = searched('backlash', (6e-5, 6e-5), 37)
    scorer = scorer_of(refits, trial)
    alike = between(trial, scorer)
    error = max(agreement(trial, scorer)['backlash'].stddev)
    assert alike[4] < 3.0 * error < 10e-6
    assert (alike[:4] < 0.2).all()


def test_a_stretch_that_cannot_know_is_not_asked() -> None:
    """Without specimen there is no gap to feel: only the halves at 250 kN/m count."""
    refits, trial = searched('specimen-gap', (2e-4, 2e-4), 35)
    found = agreement(trial, scorer_of(refits, trial))['specimen-gap']
    assert len(found.values) == 2
    assert found.agree is True


def generic(effect: str, size: float, extra: Array | float, seed: int) -> Surrogate:
    """The surrogate beside the structure with one effect."""
    refits, trial = searched(effect, (size, size), seed, extra)
    refits.scorer = scorer_of(refits, trial)
    again = refits.trial(trial.effects, effect)
    return compare(refits.data, refits.scorer, refits.trial(()), again)


def test_the_truth_beats_the_surrogate() -> None:
    """Play is no polynomial: one free feature leaves more than one true effect."""
    found = generic('backlash', 6e-5, 0.0, 36)
    assert len(found.features) == 1
    assert found.structure_error == pytest.approx(1e-5, rel=0.1)
    assert found.error > 1.2 * found.structure_error
    assert not found.beats(4e-6, 10.0)
    assert found.nats < 0.0


def test_the_surrogate_beats_a_wrong_name() -> None:
    """A sensor that adds 60 um x^2: play explains nothing of it, the surrogate finds it."""
    still = Structure(()).simulate(THETA, Record(SWEEP, SWEEP, 1 / RATE, stiffness=250e3))
    found = generic('backlash', 0.0, 6e-5 * (still / 2e-3) ** 2, 37)
    assert found.beats(4e-6, 10.0)
    assert found.place == 'sensor'
    assert found.features == ('x^2',)


@pytest.mark.filterwarnings('error')
def test_a_size_that_moves_nothing_is_fixed_by_no_stretch() -> None:
    """Where the fit stands on a bound, a derivative may vanish everywhere."""
    refits, trial = searched('delay', (2e-3, 2e-3), 3)
    jacobian = trial.fit.jacobian.copy()
    jacobian[4] = 0.0
    still = replace(trial, fit=replace(trial.fit, slopes=jacobian))
    (found,) = agreement(still, scorer_of(refits, trial)).values()
    assert found.values == () and found.agree is None and np.isnan(found.p_value)
