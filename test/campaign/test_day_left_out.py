"""Each day against all other days: what is told of it, and how seldom chance makes an outlier."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from laboratory_table import DAY, KNOWN, write_table
from scipy.stats import norm
from scipy.stats import t as student

import actuator_glue as ag
from actuator_glue.campaigns.actuator_history import history
from actuator_glue.campaigns.change_points import change_points
from actuator_glue.campaigns.day_left_out import left_out
from actuator_glue.campaigns.day_model import JUMP
from actuator_glue.campaigns.pooling import Pooled, pooled
from actuator_glue.campaigns.rows import read_results
from actuator_glue.campaigns.series import Series, series_of
from actuator_glue.cli.main import main
from actuator_glue.model.parameters import TABLE_2


def as_one_normal(series: Series, together: Pooled, draw: int, day: int) -> tuple[np.ndarray, ...]:
    """A day's deviation from all others and its covariance: all days as one large normal."""
    n, p = series.mean.shape
    steps = np.zeros((n, p))
    steps[1:] = together.walk_draws[draw] ** 2 * np.diff(series.times)[:, None]
    steps[list(together.jumps)] += JUMP**2
    walked = np.cumsum(steps, axis=0)
    joint = np.zeros((n, p, n, p))
    for t in range(n):
        for u in range(n):
            joint[t, :, u] = np.diag(walked[min(t, u)] + 1e3)  # nothing known before
        joint[t, :, t] += series.covariance[t] + np.diag(together.offset_draws[draw] ** 2)
    rest = [t for t in range(n) if t != day]
    of = joint[rest][:, :, rest].reshape((n - 1) * p, -1)
    to = joint[day][:, rest].reshape(p, -1)
    weights = np.linalg.solve(of, to.T).T
    expected = weights @ series.mean[rest].ravel()
    return series.mean[day] - expected, joint[day, :, day] - weights @ to.T


def seldom(deviation: float, variance: float, offset: float) -> float:
    """P-value of a deviation whose offset is Student's t (4) and all the rest normal."""
    x = offset * np.sinh(np.linspace(-8.0, 8.0, 4001))
    beyond = 2.0 * norm.sf((abs(deviation) - x) / np.sqrt(variance - offset**2))
    return float(np.trapezoid(student.pdf(x, 4, scale=offset / np.sqrt(2.0)) * beyond, x))


def test_the_other_days_tell_a_day_as_one_large_normal_does(tmp_path: Path) -> None:
    """Deviation and probability of every day, over a repair, against a dense reference."""
    write_table(tmp_path, seed=6, days=20, jump=(5, (0.4, -0.3, 0.0, 0.0)))
    series = series_of(read_results(tmp_path), 'north')
    changes = change_points(series)
    assert [c.place for c in changes] == [5]
    together = pooled(series, changes)
    found = left_out(series, together)
    for day in (0, 1, 3, 4, 5, 6, 7, 12, 18, 19):  # both ends, and around the repair
        if found.together[day] < 0.05:  # has draws of its own
            continue
        every = [as_one_normal(series, together, h, day) for h in range(32)]
        np.testing.assert_allclose(
            found.deviation[day], np.mean([d for d, _ in every], 0), rtol=1e-3, atol=1e-5
        )
        for i in range(4):
            hypers = zip(every, together.offset_draws[:, i], strict=True)
            p = np.mean([seldom(d[i], c[i, i], tau) for (d, c), tau in hypers])
            assert found.p_values[day, i] == pytest.approx(p, rel=0.02)


@pytest.mark.parametrize(
    'days', [4, 24, *(pytest.param(n, marks=pytest.mark.slow) for n in (7, 12))]
)
def test_days_of_an_ageing_machine_are_seldom_outliers(tmp_path: Path, days: int) -> None:
    """At most one history in 20 has one by chance: above 4 of 24 once in 170 (seeds fixed)."""
    told = 0
    for seed in range(24):
        write_table(tmp_path / str(seed), seed=seed, days=days, ageing=10.0)
        told += bool(history(tmp_path / str(seed), 'north').outliers)
    assert told <= 4


@pytest.mark.parametrize(
    ('histories', 'most'), [(6, 2), pytest.param(20, 4, marks=pytest.mark.slow)]
)
def test_days_with_heavy_tails_are_seldom_outliers(
    tmp_path: Path, histories: int, most: int
) -> None:
    """Of 12 days whose scatter is Student's t (4): about one history in eight has an outlier."""
    rng, told = np.random.default_rng(70012), 0
    for number in range(histories):
        write_table(tmp_path / str(number), seed=number, days=12)
        rows = read_results(tmp_path / str(number))
        values = np.log(TABLE_2) + DAY * rng.standard_t(4, (12, 4)) / np.sqrt(2.0)
        values += KNOWN * rng.standard_normal((12, 4))
        rows['pooling'] = [
            json.dumps({**json.loads(cell), 'mean': list(value)})
            for cell, value in zip(rows['pooling'], values, strict=True)
        ]
        series = series_of(rows, 'north')
        told += bool(left_out(series, pooled(series)).outliers.any())
    assert told <= most


@pytest.mark.parametrize(('days', 'ageing'), [(7, 1.0), (12, 10.0), (40, 1.0), (40, 10.0)])
def test_one_day_far_off_is_told_and_no_neighbour(
    tmp_path: Path, days: int, ageing: float
) -> None:
    """In the middle: by how much, and in which parameter; of few days one of 20 scatters."""
    write_table(tmp_path, seed=7, days=days, ageing=ageing)
    at, off = days // 2, 10.0 if days == 40 else 20.0
    rows = read_results(tmp_path)
    told = json.loads(rows.loc[at, 'pooling'])
    told['mean'][0] += off * DAY[0]
    rows.loc[at, 'pooling'] = json.dumps(told)
    (outlier,) = history(tmp_path, 'north', results=rows).outliers
    assert outlier.day == rows.loc[at, 'day']
    assert re.fullmatch(r'beta_1 \+\d+\.\d % off its level', outlier.reason)


@pytest.mark.parametrize(
    ('wrong', 'told'), [({'seed': -4}, 'seed -4'), ({'ahead': -1.0}, 'ahead is -1 days')]
)
def test_impossible_options_of_a_history_are_refused(
    tmp_path: Path, wrong: dict[str, float], told: str
) -> None:
    """By the call; by the command with exit code 2."""
    write_table(tmp_path, seed=8, days=3)
    with pytest.raises(ag.InputError, match=told):
        history(tmp_path, 'north', **wrong)
    assert main(['history', str(tmp_path), '--seed', '-4']) == 2


def test_a_single_day_is_no_outlier(tmp_path: Path) -> None:
    """There is nothing to hold it against."""
    write_table(tmp_path, seed=8, days=1)
    assert history(tmp_path, 'north').outliers == ()
