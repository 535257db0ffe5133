"""Output-error identification and the joint physical fit."""

import numpy as np
import pytest

from actuator_glue.errors import InputError
from actuator_glue.model import commands, linear, reference_problem
from actuator_glue.model.parameters import TABLE_2
from actuator_glue.records import Record
from studies.chen.findings import coefficients_met
from studies.chen.identify import fit_physical, fit_transfer_function, implied


@pytest.mark.parametrize('test', [0, 1])
def test_equations_3_are_recovered_without_noise(test: int) -> None:
    fit = fit_transfer_function(reference_problem.records(noise=0.0)[test])
    np.testing.assert_allclose(fit.value, reference_problem.EQUATION_3[test], rtol=1e-3)
    np.testing.assert_allclose(fit.value, reference_problem.EQUATION_3[test], rtol=1e-7)  # reached


@pytest.mark.parametrize(
    'system', [(8.0, 400.0, 400.0), (400.0, 2e4, 1.9e4), (60.0, 90.0, 85.0), (133.0, 2101.0, 50.0)]
)
def test_other_actuators_are_found_from_the_same_start(system: tuple[float, ...]) -> None:
    command = commands.sweep(400.0, 30.0, f1=15.0)
    record = Record(
        command, linear.respond(np.array([system]), command, period=1 / 400)[0], 1 / 400
    )
    np.testing.assert_allclose(fit_transfer_function(record).value, system, rtol=1e-5)


def test_confidence_limits_cover_the_truth(rng_seed: int) -> None:
    # 40 noisy tests of three coefficients, which are highly correlated within a test: at least
    # 30 tests have all three inside with probability above 1 - 1e-4 (jointly at least 85 %).
    inside = 0
    for i in range(20):
        for test, record in enumerate(reference_problem.records(rng_seed + i, duration=20.0)):
            fit = fit_transfer_function(record)
            off = np.abs(fit.value - reference_problem.EQUATION_3[test])
            inside += bool((off <= fit.reach() * fit.stddev).all())
    assert 26 <= inside <= 40
    assert fit.static_gain == pytest.approx(1.051, abs=0.01)


def test_limits_widen_with_the_noise() -> None:
    calm, noisy = (
        fit_transfer_function(reference_problem.records(3, noise=n)[0]).stddev
        for n in (1e-5, 1e-4)
    )
    np.testing.assert_allclose(noisy / calm, 10.0, rtol=0.05)


def test_unusable_records_say_so() -> None:
    with pytest.raises(InputError, match='too few'):
        fit_transfer_function(Record(np.ones(9), np.ones(9), 0.01))
    with pytest.raises(InputError, match='never moves'):
        fit_transfer_function(Record(np.zeros(99), np.zeros(99), 0.01))
    steps = np.repeat([[0.0, 1e-3], [0.0, -1e-3]], 200, axis=1)
    with pytest.raises(InputError, match='opposes'):
        fit_transfer_function(Record(*steps, 0.01))


def test_joint_fit_is_the_known_maximum_and_better_than_table_2() -> None:
    fit = fit_physical(reference_problem.records(1))
    # Mode of problem R; its posterior mean (133.65, 1.1005e9, 2.4927e5) is within a tenth of a sd.
    np.testing.assert_allclose(fit.theta[:3], [133.62, 1.1000e9, 2.4921e5], rtol=1e-3)
    assert fit.theta[3] == 0.0 and fit.at_bound.tolist() == [False, False, False, True]
    assert np.sum(fit.rms**2) < np.sum(fit.table_2_rms**2)


def test_joint_fit_recovers_a_plant_that_is_eq_2() -> None:
    truth = np.array([150.0, 1.2e9, 2.5e5, 3.0])
    command = commands.sweep(200.0, 20.0)
    records = [
        Record(command, linear.simulate(truth, command, stiffness=k, period=0.005), 0.005, k)
        for k in reference_problem.STIFFNESS
    ]
    fit = fit_physical(records)
    np.testing.assert_allclose(fit.theta, truth, rtol=1e-4)
    assert not fit.at_bound.any()


def test_table_2_satisfies_none_of_what_was_identified() -> None:
    off = implied(TABLE_2) / reference_problem.EQUATION_3 - 1.0
    assert off.shape == (2, 3) and (np.abs(off) > 0.02).all()
    assert coefficients_met(TABLE_2) == 0
    np.testing.assert_allclose(implied(TABLE_2)[0], [128.0, 4173.6, 4173.6], rtol=1e-4)
    # beta_1 = 140 and alpha_1 beta_0 / alpha_2 = 4609 without leakage are Eq. (3a).
    assert coefficients_met(np.array([140.0, 4609.0 * 2.42e5, 2.42e5, 0.0])) == 3
