"""A diagnosis for arviz: predictions and likelihoods of its draws, beside what was observed."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import arviz as az
import numpy as np
import pytest

import actuator_glue as ag

RATE = 200.0
OF_DRAWS = {'posterior_predictive', 'log_likelihood'}


def late(number: int) -> ag.Record:
    """Return a test of an actuator that its command reaches late."""
    command = ag.Command(rate=RATE, duration=10.0)
    return ag.simulate(command, stiffness=0.0, effects=['delay'], seed=(5, number))


@pytest.fixture(scope='module')
def found() -> ag.Diagnosis:
    """A diagnosis whose records are held out by blocks."""
    return ag.diagnose(late(1), effort=0.2, jobs=1)


@pytest.fixture(scope='module')
def data(found: ag.Diagnosis) -> Any:
    """Everything for arviz."""
    return found.inference_data


def test_predictions_stand_beside_what_was_observed(found: ag.Diagnosis, data: Any) -> None:
    """Of each part, fitted and held out, the same samples; 95 % of them in the 95 % band."""
    assert set(data.groups()) == {'posterior', 'observed_data', 'constant_data', *OF_DRAWS}
    assert data.posterior_predictive.attrs['held_out'] == [0, 1]
    for number, of in enumerate(found.traces, 1):
        name = f'measured_{number}'
        seen, drawn = data.observed_data[name], data.posterior_predictive[name]
        assert drawn.dims == ('chain', 'draw', f'time_{number}')
        np.testing.assert_array_equal(seen.values, of.measured)
        low, high = drawn.quantile([0.025, 0.975], dim=('chain', 'draw')).values
        assert np.mean((seen >= low) & (seen <= high)) == pytest.approx(0.95, abs=0.04)
        off = drawn.mean(dim=('chain', 'draw')).values - of.after
        assert np.sqrt(np.mean(off**2)) < 0.2 * found.error.noise_floor
    assert az.plot_ppc(data, var_names=['measured_2'], num_pp_samples=5) is not None


def test_draws_are_those_that_are_saved(found: ag.Diagnosis, data: Any, tmp_path: Path) -> None:
    """Told intervals are quantiles of the posterior group; predictions name rows of the others."""
    told = found.to_json()
    sizes = told['base'] | {n: p for e in told['effects'] for n, p in e['parameters'].items()}
    again = ag.Diagnosis.load(found.save(tmp_path / 'd.npz'))
    for i, name in enumerate(found.names):
        draws = data.posterior[name].values[0]
        np.testing.assert_array_equal(draws, again.posterior[:, i])
        np.testing.assert_array_equal(
            np.quantile(draws, [0.025, 0.975]), [sizes[name][k] for k in ('lower', 'upper')]
        )
        for group in OF_DRAWS:
            used = data[group].draw.values
            np.testing.assert_array_equal(data[group][name].values[0], again.joint[used, i])
    assert not again.records
    assert set(again.inference_data.groups()) == set(data.groups()) - OF_DRAWS


def test_terms_are_the_density_of_what_was_measured(found: ag.Diagnosis, data: Any) -> None:
    """A term a second; together the density of an AR(1) residual, by its covariance matrix."""
    residual = found.drawn().residual
    assert residual is not None
    of = found.traces[1]  # three blocks, between which nothing is known
    terms = data.log_likelihood['measured_2']
    assert terms.shape[-1] == len(np.unique(np.floor(of.time - of.time[0] + 1e-9)))
    row = 7
    draw = data.log_likelihood.draw.values[row]
    record = found.records[0]
    moved = found.model.simulate(found.joint[draw], record)
    at = np.rint(of.time * RATE).astype(int)
    error = of.measured - np.ravel(moved)[at] - residual.mean
    expected = 0.0
    for part in of.stretches():
        e = error[part]
        apart = np.abs(np.subtract.outer(np.arange(len(e)), np.arange(len(e))))
        covariance = residual.sd**2 * residual.phi**apart
        _, size = np.linalg.slogdet(2.0 * np.pi * covariance)
        expected -= 0.5 * (size + e @ np.linalg.solve(covariance, e))
    assert float(terms[0, row].sum()) == pytest.approx(expected, rel=1e-9)
    assert az.loo(data, var_name='measured_2').n_data_points == terms.shape[-1]


def test_what_cannot_be_simulated_again_is_left_out(found: ag.Diagnosis) -> None:
    """A command that is not the one that was applied says nothing of them."""
    record = found.records[0]
    shifted = replace(record, command=1.001 * record.command)
    groups = set(replace(found, records=(shifted,)).inference_data.groups())
    assert groups == {'posterior', 'observed_data', 'constant_data'}


@pytest.mark.slow
def test_tests_that_were_given_to_hold_out_are_predicted_too() -> None:
    """At a rate that is decimated, begun in motion, and under the hold that was found."""
    fast = ag.Command('noise', rate=1000.0, duration=14.0, high=5.0, seed=4)
    record = ag.simulate(fast, stiffness=250e3, hold='linear', seed=(5, 3))
    parts = [replace(record.slice(7000 * i, 7000 * (i + 1)), hold='zoh') for i in (0, 1)]
    found = ag.diagnose(parts[0], holdout=parts[1], effort=0.05, jobs=1)
    assert found.sampling[0]['fitted_rate_hz'] < 500.0
    data = found.inference_data
    assert data.posterior_predictive.attrs['held_out'] == [0, 1]
    for number, of in enumerate(found.traces, 1):
        drawn = data.posterior_predictive[f'measured_{number}'].mean(dim=('chain', 'draw'))
        at = np.searchsorted(of.time, drawn[f'time_{number}'].values)
        off = drawn.values - of.after[at]
        assert np.sqrt(np.mean(off**2)) < 0.2 * found.error.noise_floor


@pytest.mark.slow
def test_a_prediction_covers_single_samples_where_means_were_fitted(tmp_path: Path) -> None:
    """At 1024 Hz means of three are fitted; 95 % of the samples of an unseen test are inside.

    A band of the means would hold 65 to 75 %. Held-out records are among those that a name tells
    the fitted one from.
    """
    sweep = ag.Command(rate=1024.0, duration=15.0, high=8.0)
    motion = ag.Command('earthquake', rate=1024.0, duration=15.0, seed=4)
    fitted, held, unseen = (
        replace(ag.simulate(of, stiffness=250e3, seed=(7, i)), source=name)
        for i, (of, name) in enumerate(
            ((sweep, 'monday/a.csv'), (sweep, 'friday/a.csv'), (motion, ''))
        )
    )
    found = ag.diagnose(fitted, holdout=held)
    assert found.sampling[0]['fitted_rate_hz'] == pytest.approx(1024.0 / 3.0)
    for one in (found, ag.Diagnosis.load(found.save(tmp_path / 'found.npz'))):
        assert one.predict(unseen).inside == pytest.approx(0.95, abs=0.01)
    assert [of.source for of in found.tracking] == ['monday/a.csv']
