"""Results as tables of pandas: parameters, effects, windows, with the numbers that JSON has."""

import math
import sys

import numpy as np
import pytest

import actuator_glue as ag
from actuator_glue.diagnosis.estimate import Estimate
from actuator_glue.diagnosis.finding import Finding


@pytest.fixture(scope='module')
def record() -> ag.Record:
    """Six seconds at 100 Hz."""
    return ag.simulate(ag.Command(rate=100.0, duration=6.0, high=5.0), stiffness=250e3, seed=3)


@pytest.fixture(scope='module')
def posterior(record: ag.Record) -> ag.Calibration:
    """A short calibration."""
    return ag.calibrate(record, evaluations=12_000)


def size(mean: float, unit: str) -> Estimate:
    """Return a size with its interval of 2 %."""
    return Estimate(mean, 0.01 * mean, 0.98 * mean, 1.02 * mean, unit, identified=mean > 0.0)


def diagnosis() -> ag.Diagnosis:
    """Return a diagnosis of which the sizes alone are known."""
    found = ag.Diagnosis.__new__(ag.Diagnosis)
    object.__setattr__(found, 'motion', 'm')
    play = Finding(
        'backlash', ('coulomb-friction',), 0.9, '', {'backlash': size(4e-5, 'm')}, 0, 0, 0
    )
    for name, value in {
        'base': {'beta_1': size(128.0, '1/s'), 'alpha_2': size(4e6, 'N/m')},
        'base_before': {'beta_1': size(120.0, '1/s')},
        'effects': (play,),
    }.items():
        object.__setattr__(found, name, value)
    return found


def test_parameters_of_a_calibration(posterior: ag.Calibration) -> None:
    """A row each; means are those of JSON, limits those of the draws."""
    table = posterior.to_dataframe()
    assert table.index.name == 'parameter' and list(table.index) == list(posterior.names)
    for i, (name, p) in enumerate(posterior.to_json()['parameters'].items()):
        row = table.loc[name]
        for column in ('mean', 'stddev', 'skewness', 'cov', 'rhat', 'ess', 'best', 'unit'):
            assert row[column] == p[column]
        assert (row['prior_lower'], row['prior_upper']) == tuple(p['bounds'])
        inside = np.mean(
            (posterior.posterior[:, i] >= row['lower'])
            & (posterior.posterior[:, i] <= row['upper'])
        )
        assert inside == pytest.approx(0.95, abs=0.01)


def test_sizes_of_a_diagnosis() -> None:
    """Eq. (2)'s parameters and those of the effects, each with what it belongs to."""
    table = diagnosis().to_dataframe()
    assert list(table.index) == ['beta_1', 'alpha_2', 'backlash']
    assert list(table['effect']) == ['', '', 'backlash']
    assert table.loc['beta_1', 'before'] == 120.0 and math.isnan(table.loc['alpha_2', 'before'])
    assert math.isnan(table.loc['beta_1', 'probability'])
    play = table.loc['backlash']
    assert (play['mean'], play['upper'], play['unit']) == (4e-5, 1.02 * 4e-5, 'm')
    assert (play['probability'], play['alternatives']) == (0.9, 'coulomb-friction')
    assert table['identified'].all()


def test_windows_of_a_replay(record: ag.Record) -> None:
    """A row each, with every parameter of its model."""
    found = ag.replay(record, window=3.0, hop=1.0, evaluations=6000)
    table = found.to_dataframe()
    assert list(table.index) == [w.window for w in found.windows] and len(table) > 1
    for w in found.windows:
        row = table.loc[w.window]
        assert row['end_s'] == w.end_s and row['rms_m'] == w.error.rms_m
        assert row['beta_1_mean'] == w.parameters['beta_1'].mean
        assert row['alpha_2_stddev'] == w.parameters['alpha_2'].stddev
    scored = {
        w.window: b.coverage[-1] for w in found.windows for b in w.bands if b.kind == 'total'
    }
    assert scored and table['coverage'].dropna().to_dict() == scored


def test_what_to_install_is_told(
    posterior: ag.Calibration, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without pandas: one line that names the extra."""
    monkeypatch.setitem(sys.modules, 'pandas', None)
    with pytest.raises(ag.InputError, match=r"pip install 'actuator_glue\[lab\]'"):
        posterior.to_dataframe()
