"""What many tests say together: changes, levels, the next test, and what a page tells of it."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from laboratory_table import DAY, KNOWN, write_table

import actuator_glue as ag
from actuator_glue.api.pooled_prior import PooledPrior
from actuator_glue.campaigns.actuator_history import ActuatorHistory, history
from actuator_glue.campaigns.comparison import compare
from actuator_glue.campaigns.day_model import hyper_draws, walked
from actuator_glue.campaigns.first_stage import UNKNOWN
from actuator_glue.campaigns.history_page import lead
from actuator_glue.campaigns.pooling import pooled
from actuator_glue.campaigns.rows import read_results
from actuator_glue.campaigns.series import series_of
from actuator_glue.cli.main import main
from actuator_glue.model.parameters import TABLE_2

REPAIR = (36, (0.12, -0.10, 0.0, 0.0))


@pytest.fixture(scope='module')
def repaired(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A campaign of an actuator whose servo-valve was exchanged before its 37th day of test."""
    folder = tmp_path_factory.mktemp('campaign')
    there = [10 <= i < 16 or i >= 57 for i in range(60)]
    size = np.where(there, 40e-6, np.nan)
    write_table(
        folder,
        seed=3,
        jump=REPAIR,
        verdict=['missing-effect' if t else 'none' for t in there],
        effects=['backlash' if t else '' for t in there],
        backlash_mean=size,
        backlash_lower=size - 2e-6,
        backlash_upper=size + 2e-6,
        report=['reports/x.html' if t else None for t in there],
    )
    return folder


@pytest.fixture(scope='module')
def found(repaired: Path) -> ActuatorHistory:
    """Its history."""
    return history(repaired, 'north')


def test_a_repair_is_found_on_its_day(found: ActuatorHistory) -> None:
    """With its date, what it moved and by how much; nothing else is a change."""
    (change,) = found.changes
    assert change.day == found.series.days[36]
    assert change.earliest <= change.day <= change.latest
    assert change.probability > 0.99
    assert change.moved == ('beta_1', 'alpha_1_beta_0')
    for name, step in zip(change.moved, REPAIR[1], strict=False):
        ratio, low, high = found.change_sizes(change)[name]
        assert low <= np.exp(step) <= high
        assert abs(np.log(ratio) - step) < 0.02
    # A notebook, or a prompt, shows what changed and what comes next.
    for shown in (repr(found), found._repr_html_()):
        assert change.day in shown and 'Predicted for a test' in shown and 'array(' not in shown


def test_an_effect_that_stays_is_expected(found: ActuatorHistory) -> None:
    """Two spells; the last one goes on."""
    (effect,) = found.effects
    assert [s.days for s in effect.spells] == [6, 3]
    assert effect.there
    assert effect.sizes[0][:3] == ('backlash', 'm', pytest.approx(40e-6))
    # Days do not scatter: the posterior's 2 um, and a ninth of its variance for the mean.
    assert effect.sizes[0][3] == pytest.approx(40e-6 - 2e-6 * np.sqrt(10.0 / 9.0), abs=0.01e-6)


def test_an_effect_that_went_is_told(tmp_path: Path) -> None:
    """In the first lines of the page, with its last day."""
    there = [10 <= i < 16 or i == 20 for i in range(40)]
    named = ['backlash' if t else '' for t in there]
    write_table(tmp_path, seed=4, days=40, effects=named)
    gone = history(tmp_path, 'north')
    assert lead(gone).endswith(
        f'is there now. Came and went: backlash (last on {gone.series.days[20]}, 2 times).'
    )


@pytest.mark.slow
def test_pooled_intervals_and_the_next_test_hold_the_truth(tmp_path: Path) -> None:
    """0.95 of 2400 intervals of days, and of 40 next tests by 4 parameters (seeds written down).

    By chance a share of 160 is below 0.89 once in 800 times; days of one history are not
    independent, so that theirs is held to 2 %.
    """
    days, nexts, tests = [], [], 20
    for seed in range(10):
        folder = tmp_path / str(seed)
        truth = write_table(folder, seed=100 + seed, days=60)
        series = series_of(read_results(folder), 'north')
        logs = np.array(truth.logs)
        together = pooled(series)
        days.append(np.abs(together.mean - logs) < 1.96 * together.stddev)
        for cut in np.linspace(24, 59, tests // 5).astype(int):
            low, high = pooled(series.until(cut)).next_interval()
            nexts.append((np.log(low) < logs[cut]) & (logs[cut] < np.log(high)))
    assert 0.93 < np.mean(days) < 0.97
    assert 0.89 < np.mean(nexts) < 0.99


def test_scatter_of_days_is_told(found: ActuatorHistory) -> None:
    """Within a third of what it is, and the next test's interval is not narrower."""
    np.testing.assert_allclose(found.pooled.offset, DAY, rtol=0.35)
    low, high = found.pooled.next_interval()
    assert (np.log(high / low) > 2 * 1.96 * 0.7 * np.hypot(DAY, KNOWN)).all()


def test_many_days_tell_their_scatter_closely() -> None:
    """Within 6 % over eight actuators of 240 days: three times its standard error there."""
    rng, days = np.random.default_rng(11), 240
    for scatter in (0.0075, 0.010, 0.0125):
        found = []
        for _ in range(8):
            level = np.cumsum(4e-4 * np.sqrt(3.0) * rng.standard_normal(days))
            told = level + scatter * rng.standard_normal(days)
            known = np.full(days, 1e-3)
            draws = hyper_draws(3.0 * np.arange(days), told, known, (), 32, rng)
            found.append(np.median(draws[1]))
        assert np.mean(found) == pytest.approx(scatter, rel=0.06)


def test_a_test_far_off_is_an_outlier(tmp_path: Path) -> None:
    """It alone; a test that is not explained is one as well, and tells no level."""
    write_table(
        tmp_path,
        seed=5,
        days=40,
        jump=(39, (0.2, 0.0, 0.0, 0.0)),
        verdict=['unexplained' if i == 20 else 'none' for i in range(40)],
        report=['reports/odd.html' if i == 20 else None for i in range(40)],
    )
    far = history(tmp_path, 'north')
    assert [(o.group, o.report) for o in far.outliers] == [
        ('north/2025-03-02', 'reports/odd.html'),
        ('north/2025-04-28', ''),
    ]
    told = re.fullmatch(r'beta_1 (.*) % off its level', far.outliers[1].reason)
    assert told is not None
    # By exp(0.2) - 1, to three scatters of one day.
    assert float(told[1]) == pytest.approx(22.1, abs=3.7)
    assert far.changes == ()  # one day alone may be that day's
    first = lead(far)
    assert 'Out of line: north/2025-03-02: verdict' in first and far.outliers[1].reason in first
    assert 'Nothing points to' not in first
    several = lead(replace(far, outliers=(far.outliers[0], *far.outliers[1:] * 3)))
    assert far.outliers[0].group not in several and '; and 1 earlier.' in several
    assert far.series.left_out.keys() == {'north/2025-03-02'}


def test_a_posterior_that_must_not_be_used_tells_nothing(tmp_path: Path) -> None:
    """It is listed with its problem and left out of level, effects and next test."""
    problem = 'no posterior was reached: the chains of beta_1 have not met'
    write_table(tmp_path / 'sound', seed=9, days=12)
    write_table(
        tmp_path / 'odd',
        seed=9,
        days=12,
        jump=(11, (0.5, 0.0, 0.0, 0.0)),
        problems=[problem if i == 11 else ('', None)[i % 2] for i in range(12)],
        effects=['backlash' if i == 11 else '' for i in range(12)],
    )
    odd = history(tmp_path / 'odd', 'north')
    (group,) = odd.series.left_out
    assert odd.series.left_out == {group: problem}
    assert [(o.group, o.reason) for o in odd.outliers] == [(group, problem)]
    assert odd.effects == ()
    before = pooled(series_of(read_results(tmp_path / 'sound'), 'north').until(11))
    np.testing.assert_array_equal(odd.pooled.next_draws, before.next_draws)
    with pytest.raises(ag.InputError, match='the chains of beta_1 have not met'):
        compare(tmp_path / 'odd', odd.series.days[0], group)


def test_its_next_test_is_a_prior(found: ActuatorHistory, tmp_path: Path) -> None:
    """Written, read by `calibrate`, told there, and narrower intervals with it."""
    path = found.prior.save(tmp_path / 'north.npz')
    record = ag.simulate(
        ag.Command(rate=100.0, duration=8.0),
        stiffness=250e3,
        seed=4,
        theta=np.median(found.pooled.next_draws, axis=0),
    )
    alone = ag.calibrate(record, evaluations=8000, seed=1)
    with_it = ag.calibrate(record, evaluations=8000, seed=1, prior=path)
    assert with_it.prior is not None and not with_it.prior.contradicted
    assert '60 days of north' in with_it.prior.source
    narrower = [
        with_it.parameters[n].stddev / alone.parameters[n].stddev for n in with_it.parameters
    ]
    assert narrower[1] < 0.2 and narrower[2] < 0.2  # one stiffness alone leaves these open
    with pytest.raises(ag.InputError, match='prior/1'):
        ag.Calibration.load(path)
    assert PooledPrior.schema == 'actuator_glue.prior/1'


def test_sides_of_a_repair_differ(repaired: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Months before and after it do, neighbours on one side do not."""
    days = history(repaired, 'north').series.days
    apart = compare(repaired, f'{days[0]}:{days[35]}', f'{days[36]}:{days[59]}')
    assert apart.different and len(apart.a) == 36
    assert {d.name for d in apart.differences if d.p_value < 1e-6} == {'beta_1', 'alpha_1_beta_0'}
    assert abs(np.log(apart.differences[0].ratio) - 0.12) < 0.03
    # A notebook, or a prompt, shows the answer and no arrays.
    text, page = repr(apart), apart._repr_html_()
    assert text.startswith(apart.summary()) and apart.summary().split(':')[0] in page
    assert all(d.name in text and d.name in page for d in apart.differences)
    assert not compare(repaired, f'north/{days[1]}', days[2]).different
    assert main(['compare', str(repaired), days[30], days[45], '--actuator', 'north']) == 1
    said = capsys.readouterr()
    assert 'another machine: beta_1 +' in said.out
    (change,) = history(repaired, 'north').changes
    told = f'{change.day} (beta_1, alpha_1_beta_0, probability 1.000)'
    assert f'a change between A and B: {told}' in said.err.replace('\n', ' ')
    mixed = compare(repaired, f'{days[30]}:{days[40]}', days[45])
    assert mixed.notes == (f'the history has a change within A: {told}',)
    assert compare(repaired, days[1], days[2]).notes == ()
    with pytest.raises(ag.InputError, match='no such test and no day'):
        compare(repaired, '1999-01-01', days[0])


def test_ageing_makes_no_other_machine(tmp_path: Path) -> None:
    """First and last days, and halves, of 12 histories that only age (seeds fixed).

    By chance more than two of 24 differ once in 600 times: at most one in 100 does.
    """
    different = []
    for seed in range(12):
        folder = tmp_path / str(seed)
        days = write_table(folder, seed=200 + seed, days=40, ageing=10.0).days
        different += [
            compare(folder, days[0], days[-1]).different,
            compare(folder, f'{days[0]}:{days[19]}', f'{days[20]}:{days[39]}').different,
        ]
    assert sum(different) <= 2


def test_a_change_of_an_ageing_machine_is_another_machine(tmp_path: Path) -> None:
    """From one day to the next, ageing explains none of twelve scatters of days."""
    for seed in range(6):
        folder = tmp_path / str(seed)
        jump = (20, (0.12, 0.0, 0.0, 0.0))
        days = write_table(folder, seed=300 + seed, days=40, jump=jump, ageing=3.0).days
        found = compare(folder, days[19], days[20])
        assert found.different
        assert min(found.differences, key=lambda d: d.p_value).name == 'beta_1'


def test_what_sides_differ_by_as_a_level_walks() -> None:
    """The days between for two days; for stretches, as the matrix of all days tells."""
    times = np.array([0.0, 1.0, 4.0, 9.0, 11.0, 30.0])
    assert walked(times, np.array([0.0, -1.0, 0.0, 0.0, 1.0, 0.0])) == pytest.approx(10.0)
    weights = np.array([-1 / 3, -1 / 3, 1 / 3, 1 / 3, -1 / 3, 1 / 3])
    together = np.minimum.outer(times, times)
    assert walked(times, weights) == pytest.approx(weights @ together @ weights)


def test_sides_that_share_a_day_are_refused(
    repaired: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The same day, stretches that overlap, a test within the other side; neighbours are fine."""
    days = history(repaired, 'north').series.days
    with pytest.raises(ag.InputError, match=f'share {days[0]}: '):
        compare(repaired, days[0], days[0])
    with pytest.raises(ag.InputError, match=f'share {days[2]}, {days[3]}: '):
        compare(repaired, f'{days[0]}:{days[3]}', f'{days[2]}:{days[9]}')
    with pytest.raises(ag.InputError, match=f'share {days[1]}: '):
        compare(repaired, f'north/{days[1]}', f'{days[0]}:{days[3]}')
    with pytest.raises(ag.InputError, match=f'{days[4]} and 55 more: '):
        compare(repaired, f'{days[0]}:{days[59]}', f'{days[0]}:{days[59]}')
    assert main(['compare', str(repaired), days[0], days[0], '--actuator', 'north']) == 2
    assert f'share {days[0]}' in capsys.readouterr().err
    assert compare(repaired, f'{days[0]}:{days[3]}', f'{days[4]}:{days[9]}').a == days[:4]


@pytest.mark.usefixtures('undrawn')
def test_a_page_and_a_prior_for_each_actuator(
    repaired: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """What the command writes; the page says what changed, since when, what to check."""
    write_table(repaired, seed=8, days=12, actuator='south')
    pages, priors = tmp_path / 'pages', tmp_path / 'priors'
    args = ['history', str(repaired), '--report', str(pages), '--prior', str(priors)]
    assert main([*args, '--json', str(tmp_path / 'h.json')]) == 0
    assert 'north: 60 tests on 60 days from 2025-01-01 to 2025-06-27. 1 change' in (
        capsys.readouterr().out
    )
    assert sorted(p.name for p in priors.iterdir()) == ['north.npz', 'south.npz']
    text = (pages / 'north.html').read_text('utf-8')
    assert 'look at the servo-valve' in text
    assert 'backlash is there since 2025-06-21' in text
    link = re.search(r'<a href="([^"]*)">report</a>', text)
    assert link is not None
    assert (pages / link[1]).resolve() == (repaired / 'reports' / 'x.html').resolve()
    assert 'Nothing points to a repair' in (pages / 'south.html').read_text('utf-8')
    told = json.loads((tmp_path / 'h.json').read_text('utf-8'))['actuators']
    assert [a['actuator'] for a in told] == ['north', 'south']
    assert told[0]['changes'][0]['day'] == '2025-04-19'
    assert main(['history', str(tmp_path)]) == 2
    assert main(['history', str(repaired), '--actuator', 'ghost']) == 2
    assert "actuator 'ghost'" in capsys.readouterr().err


def test_a_prior_is_not_pooled_as_if_each_test_told_it(tmp_path: Path) -> None:
    """Tests of one stiffness: what the bounds decide has no history, and mixed days count once."""
    write_table(tmp_path, 11, days=30)
    path = tmp_path / 'results.parquet'
    table = pd.read_parquet(path)

    def free(text: str) -> str:
        """A test that tells the valve alone; the rest is the middle of its bounds."""
        told = json.loads(text)
        told['mean'][1:] = [23.2, 15.5, 3.6]
        told['covariance'] = np.diag([told['covariance'][0][0], *[UNKNOWN**2] * 3]).tolist()
        return json.dumps(told)

    table['pooling'] = [free(t) if i % 2 else t for i, t in enumerate(table['pooling'])]
    table.to_parquet(path)
    mixed = history(tmp_path, 'north')
    assert mixed.series.untold == () and not mixed.changes and not mixed.outliers
    low, high = mixed.pooled.next_interval()
    assert (low < TABLE_2).all() and (high > TABLE_2).all() and (high / low < 2.0)[:3].all()
    sides = compare(tmp_path, '2025-01-01:2025-02-10', '2025-02-11:2025-04-30')
    assert not sides.different and all(d.upper / d.lower < 1.5 for d in sides.differences)
    table['pooling'] = [free(t) for t in table['pooling']]
    table.to_parquet(path)
    alone = history(tmp_path, 'north')
    assert alone.series.names == ('beta_1',)
    assert alone.to_json()['untold'] == ['alpha_1_beta_0', 'alpha_2', 'alpha_3']
    assert 'No test tells' in lead(alone)
    assert alone.report(tmp_path / 'north.html').exists()


def test_an_actuator_of_any_name_has_its_files_in_the_folder(tmp_path: Path) -> None:
    """Neither beside it nor below; two that would share one have two; plain names stay."""
    names = ['north', '../north', 'Süd/1', 'Süd_1', '..', 'x' * 300]
    for name in names:
        write_table(tmp_path / 'campaign', 3, days=4, actuator=name)
    folder = tmp_path / 'priors'
    assert main(['history', str(tmp_path / 'campaign'), '--prior', str(folder)]) == 0
    assert sorted(p.name for p in tmp_path.iterdir()) == ['campaign', 'priors']
    found = sorted(p.name for p in folder.iterdir())
    assert len(found) == len(names) and {'north.npz', 'Süd_1.npz', 'Süd_1_.npz'} <= set(found)
