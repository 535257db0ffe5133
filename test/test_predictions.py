"""What a posterior predicts: displacements, responses, models for others, groups of arviz."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import arviz as az
import numpy as np
import pytest
import scipy

import actuator_glue as ag
from actuator_glue.api.drawn import Drawn
from actuator_glue.api.frequency_response import measured_response, recorded_response
from actuator_glue.model.parameters import TABLE_2
from actuator_glue.model.structure import Structure

RATE, STIFF = 200.0, 250e3


def simulated(k: float, number: int, command: ag.Command | None = None) -> ag.Record:
    """Return a simulated test; noise of its own."""
    shape = command or ag.Command(rate=RATE, duration=20.0)
    return ag.simulate(shape, stiffness=k, seed=(11, number))


@pytest.fixture(scope='module')
def posterior() -> ag.Calibration:
    """A calibration of a free test and one with a specimen."""
    return ag.calibrate([simulated(0.0, 1), simulated(STIFF, 2)], evaluations=16_000, seed=3)


@pytest.fixture(scope='module')
def data(posterior: ag.Calibration) -> Any:
    """Everything for arviz."""
    return posterior.inference_data


def eq_2a(hertz: np.ndarray, k: float) -> np.ndarray:
    """Return the response of the simulated actuator by the paper's polynomials."""
    beta_1, gain, alpha_2, alpha_3 = TABLE_2
    s = 2j * np.pi * hertz
    return gain / (
        (k + alpha_2) * s**2
        + (alpha_3 * k + beta_1 * k + beta_1 * alpha_2) * s
        + beta_1 * alpha_3 * k
        + gain
    )


@pytest.mark.parametrize('k', [0.0, 100e3])
def test_a_prediction_covers_a_test_that_nobody_fitted(
    posterior: ag.Calibration, k: float
) -> None:
    """Another command, another stiffness, other noise: 95 % of 4000 independent samples inside."""
    unseen = simulated(k, 5, ag.Command('earthquake', rate=RATE, duration=20.0, seed=4))
    found = posterior.predict(unseen)
    assert found.inside == pytest.approx(0.95, abs=0.015)  # four standard errors
    assert np.mean(found.upper - found.lower) == pytest.approx(2 * 1.96e-5, rel=0.05)
    assert np.all(found.parameter_upper - found.parameter_lower < 2e-6)
    again = posterior.predict(unseen.command, k, rate=RATE)
    np.testing.assert_array_equal(again.median, found.median)
    assert again.measured is None and again.inside is None
    assert found.plot().axes[0].get_ylabel() == 'displacement [mm]'
    table = found.to_dataframe()
    assert table.index[1] == 1 / RATE and list(table['upper']) == list(found.upper)
    assert 'measured inside' in repr(found) and 'array(' not in repr(found)
    # Under another stiffness nothing was measured; where a record leaves its own open, it is this.
    other = posterior.predict(unseen, k + 50e3)
    assert other.measured is None and 'measured inside' not in repr(other)
    left_open = replace(unseen, stiffness=None)
    for record in (unseen, left_open):
        assert posterior.predict(record, k).inside == found.inside


def test_a_shape_is_a_command(posterior: ag.Calibration, tmp_path: Path) -> None:
    """With its own rate; problems and what is not known go along."""
    shape = ag.Command('sine', rate=RATE, duration=3.0, high=2.0)
    found = posterior.predict(shape, STIFF)
    hertz = np.array([2.0])
    peak = np.abs(found.median[-200:]).max()
    # Held samples lag; at 2 Hz the gain stays.
    assert peak == pytest.approx(2e-3 * abs(eq_2a(hertz, STIFF)[0]), rel=0.01)
    again = ag.Calibration.load(posterior.save(tmp_path / 'p.npz'))
    np.testing.assert_array_equal(again.predict(shape, STIFF).upper, found.upper)
    old = replace(posterior, residual=None, problems=('not so',))
    bare = old.predict(shape, STIFF)
    assert not bare.residual_known and repr(bare).startswith('not so\n')
    np.testing.assert_array_equal(bare.upper, bare.parameter_upper)


@pytest.mark.parametrize(
    ('arguments', 'told'),
    [
        ({'command': np.zeros(9), 'stiffness': 0.0}, 'give their rate'),
        ({'command': np.zeros(9), 'rate': 100.0}, 'give the specimen stiffness'),
        ({'command': ag.Command()}, 'give the specimen stiffness'),
        ({'command': 'nothing.csv'}, 'no such file'),
        ({'command': np.zeros(9), 'stiffness': -1.0, 'rate': 100.0}, 'outside'),
    ],
)
def test_what_cannot_be_predicted(
    posterior: ag.Calibration, arguments: dict[str, Any], told: str
) -> None:
    """One clear error."""
    with pytest.raises(ag.InputError, match=told):
        posterior.predict(**arguments)


def test_a_response_is_eq_2a(posterior: ag.Calibration) -> None:
    """The truth lies in or near the band; phase, gain and delay are of one response."""
    hertz = np.array([0.2, 1.0, 5.0, 20.0])
    for k in (0.0, STIFF, 1e6):
        found = posterior.frequency_response(k, hertz)
        truth = eq_2a(hertz, k)
        np.testing.assert_allclose(found.gain.median, np.abs(truth), rtol=0.01)
        np.testing.assert_allclose(found.phase.median, np.degrees(np.angle(truth)), atol=0.5)
        np.testing.assert_allclose(
            found.delay.median, -found.phase.median / 360.0 / hertz, rtol=1e-3
        )
        for of in (found.gain, found.phase, found.delay):
            assert np.all(of.lower <= of.median) and np.all(of.median <= of.upper)
    with pytest.raises(ag.InputError, match='positive'):
        posterior.frequency_response(0.0, [0.0, 1.0])


@pytest.mark.parametrize('hold', ['zoh', 'linear'])
def test_what_was_measured_lies_on_the_response(posterior: ag.Calibration, hold: Any) -> None:
    """Spectra of a record are those of the model between the same samples."""
    shape = ag.Command('noise', rate=RATE, duration=40.0, high=15.0)
    record = ag.simulate(shape, stiffness=STIFF, hold=hold, seed=(11, 9))
    of = posterior.drawn()
    found = recorded_response(of.some(100), record)
    seen = found.measured
    assert seen is not None and len(seen.frequency) > 20
    assert seen.frequency[0] < 1.0 and 12.0 < seen.frequency[-1] < 17.0
    gain = np.interp(seen.frequency, found.frequency, found.gain.median)
    phase = np.interp(seen.frequency, found.frequency, found.phase.median)
    assert np.abs(seen.gain / gain - 1.0).max() < 0.04
    assert np.abs(seen.phase - phase).max() < 2.0
    still = replace(record, measured=np.random.default_rng(1).normal(size=len(record)) * 1e-5)
    with pytest.raises(ag.InputError, match='at no frequency'):
        measured_response(still)


def test_what_was_measured_of_a_late_actuator_has_the_turns_of_the_model() -> None:
    """Of a record that excites nothing below 8 Hz, where the actuator lags by more than 180."""
    theta = {'delay': {'delay': 0.03}}
    shape = ag.Command('noise', rate=RATE, duration=20.0, low=8.0, high=14.0)
    record = ag.simulate(shape, stiffness=STIFF, effects=theta, seed=(11, 9))
    draws = np.tile([*TABLE_2, 0.03], (3, 1))
    late = Structure(['delay'])
    of = Drawn(draws, late.names, (), draws[0], late, None, (), (), ())
    found = recorded_response(of, record)
    seen = found.measured
    assert seen is not None and seen.frequency[0] > 6.0
    assert found.phase.median[0] < -180.0
    phase = np.interp(seen.frequency, found.frequency, found.phase.median)
    assert np.abs(seen.phase - phase).max() < 10.0


def test_a_bode_plot_shows_what_was_measured(posterior: ag.Calibration, tmp_path: Path) -> None:
    """Units on every axis, black on top; records of the calibration, or a stiffness alone."""
    figure = posterior.plot_bode()
    labels = [axes.get_ylabel() for axes in figure.axes]
    assert [t for t in labels if t] == ['gain [-]', 'phase [degrees]', 'delay [ms]']
    assert len(figure.axes) == 6 and figure.axes[-1].get_xlabel() == 'frequency [Hz]'
    for axes in figure.axes:
        top = max(axes.lines, key=lambda line: line.get_zorder())
        assert top.get_color() == '#000000' and len(top.get_xdata()) > 10
    alone = posterior.plot_bode(stiffness=1e6)
    assert len(alone.axes) == 3 and alone.axes[0].get_title('left') == 'k = 1000 kN/m'
    again = ag.Calibration.load(posterior.save(tmp_path / 'p.npz'))
    assert [a.get_title('left') for a in again.plot_bode().axes[:2]] == ['free', 'k = 250 kN/m']


def test_a_bode_plot_tells_records_of_one_name_apart(posterior: ag.Calibration) -> None:
    """By the shortest paths that do so, those of the other pictures."""
    named = zip(posterior.records, ('w/day1/run.csv', 'w/day2/run.csv'), strict=True)
    found = replace(posterior, records=tuple(replace(r, source=s) for r, s in named))
    titles = [axes.get_title('left') for axes in found.plot_bode().axes[:2]]
    assert titles == ['day1/run.csv: free', 'day2/run.csv: k = 250 kN/m']


def test_a_mat_file_holds_draws_and_model(posterior: ag.Calibration, tmp_path: Path) -> None:
    """What MATLAB reads is the transfer function that python-control has, at every stiffness."""
    path = posterior.save_mat(tmp_path / 'posterior.mat')
    found = scipy.io.loadmat(path)
    np.testing.assert_array_equal(found['draws'], posterior.posterior)
    assert [str(n[0]) for n in found['names'].ravel()] == list(posterior.names)
    np.testing.assert_allclose(found['mean'].ravel(), posterior.posterior.mean(axis=0))
    np.testing.assert_allclose(found['covariance'], np.cov(posterior.posterior.T))
    assert [float(m['stiffness'].item()) for m in found['model'].ravel()] == [0.0, STIFF]
    for model in found['model'].ravel():
        k = float(model['stiffness'].item())
        for row, draw in ((None, 'mean'), (7, 7)):
            num = model['num'] if row is None else model['num_draws'][row]
            den = model['den'] if row is None else model['den_draws'][row]
            s = 2j * np.pi * 3.0
            theirs = posterior.transfer_function(k, draw)(s)
            ours = np.polyval(num.ravel(), s) / np.polyval(den.ravel(), s)
            assert ours == pytest.approx(theirs, rel=1e-6)
    one = scipy.io.loadmat(posterior.save_mat(tmp_path / 'one.mat', 1e6))['model']
    assert one.shape == (1, 1) and one[0, 0]['den'][0, 0] > 1e6
    assert posterior.save_mat(tmp_path / 'new' / 'er' / 'a.mat').exists()
    with pytest.raises(ag.InputError, match='cannot be written'):
        posterior.save_mat(tmp_path / 'one.mat' / 'a.mat')


def test_arviz_has_every_group(posterior: ag.Calibration, data: Any, tmp_path: Path) -> None:
    """Draws, likelihood in seconds, predictions beside what was observed."""
    assert set(data.groups()) >= {
        'posterior',
        'sample_stats',
        'log_likelihood',
        'posterior_predictive',
        'observed_data',
        'constant_data',
    }
    for i, record in enumerate(posterior.records, 1):
        name = f'measured_{i}'
        seen, drawn = data.observed_data[name], data.posterior_predictive[name]
        assert drawn.dims[:2] == ('chain', 'draw') and drawn.shape[2:] == seen.shape
        at = np.rint(seen[f'time_{i}'].values * RATE).astype(int)
        np.testing.assert_array_equal(seen.values, record.measured[at])
        np.testing.assert_array_equal(data.constant_data[f'command_{i}'], record.command[at])
        low, high = drawn.quantile([0.025, 0.975], dim=('chain', 'draw')).values
        assert np.mean((seen >= low) & (seen <= high)) == pytest.approx(0.95, abs=0.03)
    assert data.constant_data.attrs['stiffness_n_per_m'] == [0.0, STIFF]
    assert az.plot_ppc(data, var_names=['measured_1'], num_pp_samples=5) is not None
    bare = ag.Calibration.load(posterior.save(tmp_path / 'p.npz')).inference_data
    assert set(bare.groups()) == {'posterior', 'sample_stats'}


@pytest.mark.parametrize('likelihood', ['glue', 'gaussian', 'ar1'])
def test_terms_of_the_likelihood_add_up(
    posterior: ag.Calibration, data: Any, likelihood: Any
) -> None:
    """To the log likelihood of each draw, but for one constant; a term for each second."""
    if likelihood != 'glue':
        data = ag.calibrate(
            posterior.records[1], likelihood=likelihood, evaluations=16_000
        ).inference_data
    terms = data.log_likelihood
    assert terms['measured_1'].shape[-1] == 21  # the 4001st sample begins another second
    total = sum(t.sum(dim=t.dims[-1]) for t in terms.data_vars.values())
    constant = (data.sample_stats['lp'].sel(draw=terms.draw) - total).values
    assert np.ptp(constant) < 1e-6 * abs(constant).max()
    assert np.ptp(total.values) > 1.0
    found = az.loo(data, var_name='measured_1')
    assert found.n_data_points == 21 and found.elpd_loo > 0.0


@pytest.mark.parametrize('rate', [0, -1000.0, float('nan'), float('inf'), 'fast', None])
def test_samples_need_a_rate_that_can_be(posterior: ag.Calibration, rate: Any) -> None:
    """One sentence that names the argument and what to give."""
    command = simulated(STIFF, 6).command
    with pytest.raises(ag.InputError, match=r'rate.*give|give their rate') as refused:
        posterior.predict(command, STIFF, rate=rate)
    assert rate is None or repr(rate).removesuffix('.0') in str(refused.value)
    with pytest.raises(ag.InputError, match='rate'):
        ag.Command(rate=rate).samples()


@pytest.mark.parametrize('path', [None, 7, b'a.npz', ['a.npz']])
def test_files_need_a_name(
    posterior: ag.Calibration, path: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What is no path is refused as such, before a page is made, and says what to give."""
    monkeypatch.setattr(ag.Calibration, 'page', lambda *_: pytest.fail('a page is made'))
    loads = ag.Calibration.load, ag.effects.load_effects
    for use in (posterior.save, posterior.save_mat, posterior.report, *loads):
        with pytest.raises(
            ag.InputError, match=r"path is .*; give the name of a file, as 'monday"
        ):
            use(path)


def test_folders_of_results_are_made(posterior: ag.Calibration, tmp_path: Path) -> None:
    """As those of reports are."""
    assert posterior.save(tmp_path / 'new' / 'er' / 'a.npz').exists()
    with pytest.raises(ag.InputError, match='cannot be written'):
        posterior.save(tmp_path / 'new' / 'er' / 'a.npz' / 'b.npz')
