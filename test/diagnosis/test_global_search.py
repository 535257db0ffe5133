"""Dry friction that holds the piston for a good part of a test: many minima, one of them right."""

import numpy as np
import pytest

from actuator_glue.diagnosis.diagnose import diagnose
from actuator_glue.diagnosis.refits import global_search
from actuator_glue.diagnosis.refits.refits import Refits
from actuator_glue.diagnosis.score.scorer import Scorer, splits_of
from actuator_glue.diagnosis.thresholds import Thresholds
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.inference.least_squares.fit import Fit, fit
from actuator_glue.model import commands
from actuator_glue.model.effects import scale
from actuator_glue.model.structure import Structure
from actuator_glue.records import Record

RATE = 128.0
COULOMB = Structure(('coulomb-friction',))
THETA = np.array([134.0, 1.1e9, 2.5e5, 0.5, 150.0])  # friction holds it for 0.6 mm of 2


def held_up(seed: int, stiffnesses: tuple[float, ...] = (0.0, 250e3)) -> list[Record]:
    """Random commands of 2 mm at most, 10 um of noise."""
    rng = np.random.default_rng(seed)
    records = []
    for k in stiffnesses:
        command = commands.noise(RATE, 24.0, 0.5, 8.0, seed=int(rng.integers(1 << 31)))
        command *= 2e-3 / np.abs(command).max()
        silent = Record(command, command, 1 / RATE, stiffness=k)
        measured = COULOMB.simulate(THETA, silent) + 1e-5 * rng.standard_normal(len(command))
        records.append(Record(command, measured, 1 / RATE, stiffness=k))
    return records


def slopes_alone(data: Data) -> Fit:
    """What Gauss and Newton find from the usual starts."""
    base = Refits(data, ()).base()
    starts = COULOMB.starts(base.theta, scale(data.records, base.theta))
    return fit(data, COULOMB, starts, iterations=8)


def found_in(data: Data) -> Fit:
    """What a population finds, from where the slopes end."""
    return global_search.refit(data, COULOMB, slopes_alone(data), 8, 1e-4)


def right(found: Fit) -> bool:
    """Whether it is the lowest minimum."""
    return found.rms < 1.2e-5 and found.theta[4] == pytest.approx(150.0, rel=0.04)


def test_the_lowest_minimum_of_a_machine_is_found() -> None:
    """Of one that the slopes miss; twice the same."""
    data = Data.whole(held_up(1))
    assert not right(slopes_alone(data))
    found, again = found_in(data), found_in(data)
    assert right(found)
    np.testing.assert_array_equal(again.theta, found.theta)


@pytest.mark.slow
def test_the_lowest_minimum_is_found(rng_seed: int) -> None:
    """Slopes alone leave 10 to 59 um (median 22) where 10 are noise, the population 9.8 to 11.5.

    The population misses 3 of 1 031 machines (95 % interval 0.1 to 0.9 %), slopes alone 91 %:
    three of four are missed once in 300 000 tests even at 0.9 %.
    """
    seeds = np.random.default_rng(rng_seed).integers(1 << 31, size=4)
    missed = sum(not right(found_in(Data.whole(held_up(seed)))) for seed in seeds.tolist())
    assert missed < 3


def test_what_is_found_is_never_worse_than_what_was_there() -> None:
    """No friction at all: the fit stays what it is, or becomes better."""
    record = held_up(3)[1]
    silent = Record(record.command, record.command, record.period, stiffness=250e3)
    measured = COULOMB.simulate(np.array([*THETA[:4], 0.0]), silent)
    data = Data.whole([Record(record.command, measured, record.period, stiffness=250e3)])
    before = slopes_alone(data)
    assert global_search.refit(data, COULOMB, before, 8, 1e-4).rms <= before.rms


@pytest.mark.slow
def test_the_diagnosis_names_it_with_its_size() -> None:
    """With slopes alone it was Coulomb friction of 139 N and a lag of the valve beside it."""
    *records, held = held_up(5, (0.0, 250e3, 250e3))
    found = diagnose(records, held, settings=Thresholds(evaluations=0))
    assert [e.name for e in found.effects] == ['coulomb-friction']
    size = found.effects[0].parameters['coulomb_force']
    assert size.mean == pytest.approx(150.0, rel=0.02)
    assert found.error.after == pytest.approx(1e-5, rel=0.1)


def test_friction_under_one_stiffness_goes_along_its_ridge(rng_seed: int) -> None:
    """From nine times its size beside stiffer oil; in N and N/m the fit stays there.

    Of 60 seeds the ridge led to 4.9 to 5.2 um and 331 to 423 N, otherwise 6.0 to 6.2 um and 2547
    to 2689 N: 0 false failures (95 % interval 0 to 6 %).
    """
    theta = np.array([128.0, 1.01e9, 2.42e5, 0.3, 300.0])
    command = commands.sweep(RATE, 60.0, 0.0, 10.0, 2e-3)
    silent = Record(command, command, 1 / RATE, stiffness=250e3)
    measured = COULOMB.simulate(theta, silent)
    measured = measured + 5e-6 * np.random.default_rng(rng_seed).standard_normal(len(command))
    data = Data.whole([Record(command, measured, 1 / RATE, stiffness=250e3)])
    start = theta * [1.0, 9.0, 16.0, 1.8, 9.0]
    there = fit(data, COULOMB, global_search.along_ridge(data, COULOMB, start))
    assert there.rms < 5.5e-6
    assert there.theta[4] < 600.0
    assert there.rms < fit(data, COULOMB, start).rms


@pytest.mark.slow
def test_a_hold_that_explains_less_is_not_searched_with() -> None:
    """Of friction that holds the piston Eq. (2) leaves 150 um, 1 um less with the other hold."""
    theta, rng = np.array([128.0, 1.01e9, 2.42e5, 0.3, 300.0]), np.random.default_rng(1)
    command = commands.sweep(RATE, 40.0, 0.0, 10.0, 2e-3)
    stages, silent = [], Record(command, command, 1 / RATE, stiffness=250e3)
    measured = COULOMB.simulate(theta, silent) + 1e-5 * rng.standard_normal(len(command))
    record = Record(command, measured, 1 / RATE, stiffness=250e3)
    found = diagnose(
        [record],
        settings=Thresholds(evaluations=0),
        progress=lambda stage, share: stages.append(stage),
    )
    assert [e.name for e in found.effects] == ['coulomb-friction']
    assert stages.count('base fit') == 1


def test_a_lag_does_not_change_places_with_the_valve() -> None:
    """Poles of 87, 127 and 143 1/s: which is the transducer's is told by a specimen alone.

    From Eq. (2)'s fit the slopes lead to a lag of 4.8 ms beside a slower valve, 10.0 um instead of
    9.9 um; the truth is 7.83 ms.
    """
    theta = np.array([230.0, 1.71e10, 5.35e6, 26.2, 7.83e-3])
    model, rng, records = Structure(('sensor-lag',)), np.random.default_rng(4), []
    command = commands.sweep(RATE, 24.0, 0.0, 10.0, 2e-3)
    for k in (0.0, 2e6):
        measured = model.simulate(theta, Record(command, command, 1 / RATE, stiffness=k))
        measured += 1e-5 * rng.standard_normal(len(command))
        records.append(Record(command, measured, 1 / RATE, stiffness=k))
    refits = Refits(Data.whole(records), ('sensor-lag',))
    refits.scorer = Scorer.of(refits.data, splits_of(refits.data, refits.base().error))
    found = refits.polish(refits.add(refits.trial(()), 'sensor-lag')).fit
    assert found.theta[[0, 4]] == pytest.approx(theta[[0, 4]], rel=0.03)
