"""The row of a group: what a calibration and a diagnosis of it say, under columns that stay."""

from pathlib import Path

import numpy as np
import pytest

import actuator_glue as ag
from actuator_glue.campaigns.analysis import analysed, judged
from actuator_glue.campaigns.first_stage import UNKNOWN, first_stage
from actuator_glue.campaigns.grouping import tasks_of
from actuator_glue.campaigns.recipe import parse_recipe
from actuator_glue.io.export import write


@pytest.fixture(scope='module')
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two tests of one day, free and clamped."""
    place = tmp_path_factory.mktemp('day')
    for name, k in (('free', 0.0), ('clamped', 250e3)):
        test = ag.simulate(ag.Command(rate=100.0, duration=8.0), stiffness=k, seed=(2, int(k)))
        write(place / f'north_20260301T090000_{name}.csv', test)
    return place


RECIPE = {
    'names': r'(?P<actuator>[a-z]+)_(?P<started>\d{8}T\d{6})_(?P<specimen>[a-z]+)',
    'group': ['actuator', 'day'],
    'calibrate': {'evaluations': 16000, 'seed': 7},
    'diagnose': 'never',
    'partition': 'sdof',
    'draws': True,
}


def test_a_row_says_what_the_calibration_says(folder: Path, tmp_path: Path) -> None:
    """The same numbers as `calibrate` and `rths`, to the bit, draws kept where asked for."""
    (task,) = tasks_of([folder], parse_recipe(RECIPE, folder))
    row = analysed(task, tmp_path, 'k')
    records = [r for m in task.members for r in m.records()]
    alone = ag.calibrate(records, evaluations=16000, seed=7)
    for i, name in enumerate(alone.names):
        assert row[f'{name}_mean'] == alone.posterior[:, i].mean()
        assert row[f'{name}_lower'] < row[f'{name}_mean'] < row[f'{name}_upper']
    judged = ag.rths('sdof', alone)
    assert row['p_unstable'] == judged.p_unstable.value
    assert judged.margin_s is not None and row['margin_s_mean'] == judged.margin_s.mean
    assert (row['actuator'], row['day'], row['started']) == (
        'north',
        '2026-03-01',
        '2026-03-01T09:00:00',
    )
    assert (row['verdict'], row['records']) == ('none', 2)
    assert row['duration_s'] == pytest.approx(sum(r.duration for r in records))
    assert 0.0 < row['delay_at_5_hz_s_lower'] < row['delay_at_5_hz_s_mean']
    assert np.array_equal(ag.Calibration.load(tmp_path / row['draws']).draws, alone.draws)


@pytest.mark.slow
def test_a_row_says_what_the_diagnosis_says(tmp_path: Path) -> None:
    """Its effect, sizes and report, and no problem of the calibration that asked for it."""
    for name, k in (('free', 0.0), ('clamped', 250e3)):
        test = ag.simulate(
            ag.Command(rate=200.0, duration=15.0),
            stiffness=k,
            effects={'backlash': {'backlash': 6e-5}},
            seed=(2, int(k)),
        )
        write(tmp_path / f'north_20260301T090000_{name}.csv', test)
    asked = {**RECIPE, 'diagnose': 'structure', 'partition': None, 'draws': False}
    (task,) = tasks_of([tmp_path], parse_recipe(asked, tmp_path))
    row = analysed(task, tmp_path, 'k')
    assert (row['verdict'], row['effects'], row['problems']) == ('missing-effect', 'backlash', '')
    assert row['backlash_lower'] <= 6e-5 <= row['backlash_upper']
    assert row['error_after_m'] < 0.6 * row['error_before_m']
    assert 'backlash' in (tmp_path / row['report']).read_text('utf-8')


@pytest.mark.slow
def test_a_delay_that_was_named_is_in_the_margin(folder: Path) -> None:
    """4 ms of it cost 4 ms of the margin; play, which no linear loop has, costs nothing."""
    (task,) = tasks_of([folder], parse_recipe(RECIPE, folder))
    wanted = {**task.analysis, 'calibrate': {'evaluations': 8000, 'seed': 7}}
    margins = []
    for late in ({}, {'delay': {'delay': 4e-3}}):
        test = ag.simulate(
            ag.Command(rate=100.0, duration=8.0), stiffness=250e3, seed=3, effects=late
        )
        found = ag.calibrate(test, evaluations=8000, seed=7)
        row = judged(found, [test], ('backlash', *late), wanted)
        margins.append(row['margin_s_mean'])
    assert margins[0] - margins[1] == pytest.approx(4e-3, abs=0.5e-3)


def test_remarks_on_files_are_in_the_row(folder: Path, tmp_path: Path) -> None:
    """They were dropped; the folder that the files are in is no part of a row."""
    copies = tmp_path / 'copies'
    copies.mkdir()
    for file in folder.glob('*.csv'):
        said = '# sample rate: 1024 Hz\n' * file.name.endswith('_free.csv')
        (copies / file.name).write_text(said + file.read_text())
    (task,) = tasks_of([copies], parse_recipe({**RECIPE, 'draws': False}, copies))
    row = analysed(task, tmp_path, 'k')
    assert "_free.csv: it says 'sample rate: 1024 Hz', and is taken at 100 Hz" in row['remarks']
    assert str(tmp_path) not in row['remarks'] and row['remarks'].count('it says') == 1
    (task,) = tasks_of([folder], parse_recipe({**RECIPE, 'draws': False}, folder))
    assert analysed(task, tmp_path, 'k')['remarks'] == ''


def test_what_is_held_out_is_not_fitted(folder: Path, tmp_path: Path) -> None:
    """One record left is one record; none left is a reason."""
    some = parse_recipe({**RECIPE, 'holdout': '*_free.*', 'draws': False}, folder)
    row = analysed(tasks_of([folder], some)[0], tmp_path, 'k')
    assert (row['records'], row['stiffness_n_per_m']) == (1, '250000')
    with pytest.raises(ag.InputError, match='every record is held out'):
        analysed(
            tasks_of([folder], parse_recipe({**RECIPE, 'holdout': '*'}, folder))[0], tmp_path, 'k'
        )


def test_pooling_is_of_logarithms(rng_seed: int) -> None:
    """Mean and covariance of what was drawn; nothing where draws reach zero (never by chance)."""
    rng = np.random.default_rng(rng_seed)
    names = ('beta_1', 'alpha_1_beta_0', 'backlash', 'alpha_2', 'alpha_3')
    logs = 0.1 * rng.standard_normal((500, 5))
    told = first_stage(np.exp(logs), names)
    assert told is not None and told['names'] == [n for n in names if n != 'backlash']
    np.testing.assert_allclose(told['mean'], logs[:, [0, 1, 3, 4]].mean(axis=0))
    np.testing.assert_allclose(told['covariance'], np.cov(logs[:, [0, 1, 3, 4]].T))
    assert first_stage(np.exp(logs) * [1, 1, 1, 0, 1], names) is None


def test_what_a_test_leaves_to_its_bounds_is_unknown() -> None:
    """A free test tells the valve and a ratio: the prior of the others is no knowledge of it."""
    rng = np.random.default_rng(7)
    names = ('beta_1', 'alpha_1_beta_0', 'alpha_2', 'alpha_3')
    bounds = {'beta_1': (0.0, 400.0), 'alpha_1_beta_0': (0.0, 2e10)}
    bounds |= {'alpha_2': (0.0, 1e7), 'alpha_3': (0.0, 100.0)}
    # Uniform over the ridge as its prior is, until alpha_1_beta_0 reaches its bound.
    ridge = np.sqrt(rng.random(4000)) * 2e10 / 4170.0
    valve = 128.0 * np.exp(0.003 * rng.standard_normal(4000))
    free = np.column_stack([valve, 4170.0 * ridge, ridge, 100.0 * rng.random(4000)])
    told = first_stage(free, names, bounds)
    assert told is not None
    deviations = np.sqrt(np.diag(told['covariance']))
    assert deviations[0] == pytest.approx(0.003, rel=0.05)
    assert (deviations[1:] == UNKNOWN).all()
    # A pair tells all of them, and a leakage of +- 40 % is told, too.
    leakage = 3.0 * np.exp(0.4 * rng.standard_normal(4000))
    pair = np.column_stack([valve, 7.9e6 * valve, 1900.0 * valve, leakage])
    told = first_stage(pair, names, bounds)
    assert told is not None
    np.testing.assert_allclose(told['covariance'], np.cov(np.log(pair).T))
    # So is one near zero, whose logarithm is as wide: it is known to be small.
    tight = np.column_stack([pair[:, :3], 0.02 * rng.standard_exponential(4000)])
    told = first_stage(tight, names, bounds)
    assert told is not None
    np.testing.assert_allclose(told['covariance'], np.cov(np.log(tight).T))
