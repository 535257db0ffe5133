"""From a posterior to P(unstable): known loops, the public API, the command line."""

import json
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest
from scipy import signal, stats

import actuator_glue as ag
from actuator_glue.api import store
from actuator_glue.api.calibration_parts import CalibratedRecord, FitError, Marginal
from actuator_glue.api.compensation import Comparison
from actuator_glue.cli.main import main
from actuator_glue.hybrid.stability import share
from actuator_glue.model import linear
from actuator_glue.model.parameters import BASE
from actuator_glue.model.structure import Structure

MEAN = np.array([133.65, 1.1005e9, 2.4927e5, 0.006])  # problem R
# What Eq. (2) lags at low frequencies with these: about d1/d0.
LAG = 0.0307


def posterior(
    spread: float = 0.01, effects: tuple[str, ...] = (), seed: int = 0
) -> ag.Calibration:
    """A calibration with draws made here: independent, normal, no sampler involved."""
    structure = Structure(effects)
    rng = np.random.default_rng(0)
    centre = structure.neutral(MEAN)
    if 'delay' in effects:
        centre[structure.columns('delay')] = 0.004
    draws = np.abs(centre * (1.0 + spread * rng.standard_normal((250, 4, len(centre)))))
    marginals = {
        p.name: Marginal(c, 1.0, 0.0, 1.0, 1.0, 900.0, c, p.unit, (p.lower, p.upper), False)
        for p, c in zip(structure.parameters, map(float, centre), strict=True)
    }
    return ag.Calibration(
        parameters=marginals,
        draws=draws,
        log_density=np.zeros((250, 4)),
        best=centre,
        error=FitError(0.0, 0.0, ()),
        at_bound=(),
        problems=(),
        notes=(),
        converged=True,
        effects=effects,
        likelihood='glue',
        shaping_factor=256.0,
        seed=1,
        initial='rest',
        settle=0.0,
        evaluations=1,
        seconds=0.0,
        compile_seconds=0.0,
        sources=(CalibratedRecord('test', 1, 200.0, 250e3, 'zoh'),),
    )


def structure(damping: float, delay: float = 0.0, rate: float = 8192.0) -> ag.Partition:
    """One degree of freedom at 1 Hz, all stiffness in the specimen."""
    w = 2.0 * np.pi
    return ag.Partition(
        mass=1000.0,
        damping=2.0 * damping * w * 1000.0,
        stiffness=0.0,
        specimen=ag.Specimen(0.0, 0.0, w**2 * 1000.0),
        rate=rate,
        computation_delay=delay,
    )


def test_stable_and_unstable_for_certain() -> None:
    """Damping far above and far below what the lag takes: c_eq = -k tau (Horiuchi 1999)."""
    needed = LAG * np.pi  # tau = 2 zeta / w
    for damping, value in ((2.0 * needed, 0.0), (0.5 * needed, 1.0)):
        found = ag.rths(structure(damping), posterior())
        assert found.p_unstable.value == value
        assert np.all((found.margins_drawn > 0.0) == (value == 0.0))
        assert (found.p_unstable.upper < 0.01) == (value == 0.0)
        assert found.go(0.05) == (value == 0.0)


def test_each_draw_has_the_roots_of_its_polynomial() -> None:
    """Fast sampling: the rightmost root of (m s^2 + c s)(d2 s^2 + d1 s + d0) + k n0 = 0."""
    partition = structure(0.09, rate=1e5)
    calibration = posterior(0.05)
    found = ag.rths(partition, calibration, draws=20)
    rows = np.linspace(0, 999, 20).astype(int)
    k = partition.specimen.stiffness
    for theta, growth in zip(calibration.posterior[rows], found.growth_drawn, strict=True):
        n0, d2, d1, d0 = (float(v) for v in linear.coefficients(theta, k))
        poly = np.polymul([1000.0, partition.damping[0, 0], 0.0], [d2, d1, d0])
        poly[-1] += k * n0
        assert growth == pytest.approx(np.roots(poly).real.max(), abs=1e-3)
    mixed = found.growth_drawn > 0.0
    assert 0.0 < mixed.mean() < 1.0
    assert found.p_unstable.value == mixed.mean()


@pytest.mark.parametrize('effects', [(), ('delay',)])
def test_margin_is_the_delay_that_makes_the_draw_unstable(effects: tuple[str, ...]) -> None:
    """With 0.99 of the margin in the computation every draw is stable, with 1.01 the worst not."""
    calibration = posterior(1e-9, effects)
    found = ag.rths(structure(0.14, rate=1024.0), calibration, draws=3)
    assert found.margin_s is not None and found.margin_s.mean > 0.0
    for factor, value in ((0.99, 0.0), (1.01, 1.0)):
        late = structure(0.14, factor * found.margin_s.mean, rate=1024.0)
        assert ag.rths(late, calibration, draws=3).p_unstable.value == value


def test_a_delay_costs_its_length() -> None:
    """Materiality in terms of the margin: 4 ms of transport delay cost 4 ms of it."""
    found = ag.rths(structure(0.2), posterior(0.01, ('delay',)), draws=50)
    assert found.margin_s is not None and found.margin_s.lower > 0.0
    cost = found.effect_cost_s['delay']
    assert cost.median == pytest.approx(0.004, rel=0.02)
    told = found.to_json()['indicators']['effect_cost_s']['delay']
    assert told['median'] == cost.median


def test_tracking_is_that_of_scipy() -> None:
    """Delay and amplitude at a frequency, bandwidth, of nearly one draw."""
    found = ag.rths('sdof', posterior(1e-12), draws=2, frequencies=(5.0,))
    k = 19739.20880217872
    n0, d2, d1, d0 = (float(v) for v in linear.coefficients(MEAN, k))
    _, gain = signal.freqs([n0], [d2, d1, d0], worN=[2 * np.pi * 5.0])
    at = found.tracking[0]
    assert at.amplitude.mean == pytest.approx(abs(gain[0]), rel=1e-6)
    assert at.delay_s.mean == pytest.approx(-np.angle(gain[0]) / (10 * np.pi), rel=1e-6)
    w = 2 * np.pi * found.bandwidth_hz.mean
    _, half = signal.freqs([n0], [d2, d1, d0], worN=[w])
    assert abs(half[0]) == pytest.approx(n0 / d0 / np.sqrt(2.0), rel=1e-6)


def test_the_inverse_makes_the_benchmark_stable() -> None:
    """Uncompensated the lag exceeds its margin; the inverse leaves nearly all of it."""
    calibration = posterior(0.01)
    plain = ag.rths('benchmark_case_1', calibration, draws=200)
    assert plain.p_unstable.value == 1.0 and plain.margin_s is not None
    assert plain.margin_s.upper < 0.0
    inverse = ag.rths('benchmark_case_1', calibration, draws=200, compensator='inverse')
    assert inverse.p_unstable.value == 0.0 and inverse.margin_s is not None
    assert inverse.compensator.startswith('inverse')
    assert inverse.margin_s.mean == pytest.approx(inverse.delay_margin.sampled, abs=1e-3)
    assert any('extrapolates' in line for line in inverse.notes)


def test_the_interval_is_that_of_clopper_and_pearson() -> None:
    """Scipy's exact one, and that of the fewer draws that correlated ones are worth."""
    hits = np.arange(200) < 7
    found = share(hits, 1e9)
    exact = stats.binomtest(7, 200).proportion_ci(0.95, 'exact')
    assert (found.lower, found.upper) == pytest.approx((exact.low, exact.high), rel=1e-9)
    fewer = share(hits, 40.0)
    assert fewer.upper > found.upper and fewer.effective_draws == 40.0
    assert share(hits & False, 1000.0).upper == pytest.approx(1 - 0.025 ** (1 / 200), rel=1e-9)


def test_the_most_sensitive_parameter_is_found() -> None:
    """Only one parameter varies; a margin that does not vary follows none."""
    calibration = posterior(0.0)
    draws = calibration.draws.copy()
    draws[..., 1] *= np.linspace(0.9, 1.1, 1000).reshape(250, 4)
    found = ag.rths('sdof', replace(calibration, draws=draws))
    assert found.most_sensitive == BASE[1].name
    assert found.sensitivity['alpha_1_beta_0'] > 0.99
    assert ag.rths('sdof', calibration).most_sensitive is None


def test_what_cannot_be_used_is_told() -> None:
    """Options, effects, draws."""
    for wrong, said in (
        ({'draws': 1}, 'at least 2'),
        ({'frequencies': (0.0,)}, 'frequency'),
        ({'compensator': 'magic'}, 'magic'),
        ({'criteria': {'drift': 0.1}}, 'ground motion'),
        ({'ground_motion': 'artificial', 'criteria': {'pain': 0.1}}, 'pain'),
        ({'ground_motion': 'artificial', 'criteria': {'drift': 0.0}}, 'drift'),
        ({'ground_motion': 'nowhere.at2'}, 'nowhere'),
        ({'seed': -1}, 'seed'),
    ):
        with pytest.raises(ag.InputError, match=said):
            ag.rths('sdof', posterior(), **wrong)
    with pytest.raises(ag.InputError, match='backlash'):
        ag.rths('sdof', posterior(effects=('backlash',)))
    with pytest.raises(ag.InputError, match='benchmark_case_1'):
        ag.rths('nothing', posterior())


def test_a_calibration_hands_out_its_transfer_function() -> None:
    """Eq. (2a) at python-control's hand."""
    calibration = posterior()
    w = 2.0 * np.pi * np.array([1.0, 5.0, 10.0])
    for draw, theta in (('best', MEAN), (3, calibration.posterior[3])):
        expected = linear.frequency_response(theta, 250e3, w / (2.0 * np.pi))
        for made in (calibration.transfer_function, calibration.state_space):
            np.testing.assert_allclose(made(250e3, draw)(1j * w), expected, rtol=1e-9)
    # No dust of the arithmetic among its terms.
    assert [len(made) for made in calibration.transfer_function(0.0).num[0]] == [1]
    with pytest.raises(ag.InputError, match='draw'):
        calibration.transfer_function(250e3, 'median')
    with pytest.raises(ag.InputError, match='delay'):
        posterior(effects=('delay',)).transfer_function(250e3)


@pytest.mark.usefixtures('undrawn')
def test_the_result_is_kept_and_shown(tmp_path: Path) -> None:
    """File, figure, report, notebook."""
    found = ag.rths('benchmark_case_1', posterior(), draws=50)
    again = ag.StabilityResult.load(found.save(tmp_path / 'stability.npz'))
    assert again.to_json() == found.to_json()
    np.testing.assert_array_equal(again.margins_drawn, found.margins_drawn)
    assert len(found.plot().axes) == 2
    assert 'P(unstable) = 1' in found.report(tmp_path / 'report.html').read_text()
    assert 'P(unstable) = 1' in found._repr_html_()


def test_the_command_line_decides(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Text, JSON and exit code say the same; a posterior with problems never goes."""
    path = posterior().save(tmp_path / 'posterior.npz')
    bad = replace(posterior(), problems=('the model does not fit',)).save(tmp_path / 'bad.npz')
    out = tmp_path / 'out.json'
    for partition, file, limit, code in (
        ('sdof', path, ['--limit', '1.0'], 0),
        ('benchmark_case_1', path, ['--limit', '0.05'], 1),
        ('benchmark_case_1', path, [], 0),
        ('sdof', bad, ['--limit', '1.0'], 1),
    ):
        command = ['rths', partition, '--posterior', str(file), '--draws', '100']
        assert main([*command, *limit, '--json', str(out), '--force']) == code
        said, found = capsys.readouterr().out, json.loads(out.read_text())
        assert found['schema'] == 'actuator_glue.rths/1'
        if limit:
            assert found['go'] == (code == 0) and (('NO-GO' in said) == (code == 1))
        assert f'P(unstable) = {found["p_unstable"]["value"]:.4g}' in said
    assert main(['rths', 'sdof', '--posterior', str(path), '--limit', '2']) == 2
    twice = ['--fail', 'drift=0.1', '--fail', 'force=5', '--fail', 'drift=0.2']
    shaken = ['rths', 'sdof', '--posterior', str(path), '--ground-motion', 'artificial']
    assert main([*shaken, *twice]) == 2
    assert '--fail drift: one limit' in capsys.readouterr().err


def test_a_record_too_short_for_slow_growth_is_no_go() -> None:
    """Each draw is unstable without its play, but moves no five times as far within 40 s."""
    slow, calm = (
        ag.rths(
            structure(factor * LAG * np.pi, rate=1024.0),
            posterior(1e-4, ('backlash',)),
            draws=64,
            ground_motion='artificial',
        )
        for factor in (1.13, 2.0)
    )
    assert 0.0 < slow.growth_per_s.lower < slow.growth_per_s.upper < 1.0 / 40.0
    assert slow.virtual is not None and slow.virtual.diverged.upper < 0.1
    assert slow.p_unstable.value == 0.0 and slow.p_unstable.upper == 1.0
    assert not slow.go(0.1)
    assert '100 % of the draws do not diverge in 40 s, but are unstable' in slow.notes[0]
    assert calm.go(0.1) and not any('diverge' in line for line in calm.notes)


def test_a_loop_that_friction_holds_is_no_slow_growth() -> None:
    """Without friction each draw would grow 50 times or more in 40 s: long enough."""
    rubbing = posterior(0.002, ('coulomb-friction',))
    rubbing.draws[..., Structure(('coulomb-friction',)).columns('coulomb-friction')] = 300.0
    held = ag.rths(
        structure(0.9 * LAG * np.pi, rate=512.0), rubbing, draws=64, ground_motion='artificial'
    )
    assert held.growth_per_s.lower > 0.1
    assert held.virtual is not None and held.p_unstable == held.virtual.diverged
    assert held.go(0.1) and not any('diverge' in line for line in held.notes)


def test_a_virtual_test_shows_how_far_it_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """After each block of draws; on the command line, too."""
    from actuator_glue.cli import rths as command

    shares: list[float] = []
    options = {'draws': 70, 'ground_motion': 'artificial'}
    ag.rths('sdof', posterior(), progress=shares.append, **options)
    assert shares == pytest.approx([1 / 3, 2 / 3, 1.0])
    shown: list[float] = []
    monkeypatch.setattr(command, 'progress', lambda *_: nullcontext(shown.append))
    path = str(posterior().save(tmp_path / 'posterior.npz'))
    main(['rths', 'sdof', '--posterior', path, '--draws', '70', '--ground-motion', 'artificial'])
    assert shown == shares
    monkeypatch.setattr(command, 'progress', Mock(side_effect=AssertionError))
    assert main(['rths', 'sdof', '--posterior', path, '--draws', '70']) == 0  # nothing to show


@pytest.mark.parametrize('best', ['none', 'ats'])
def test_no_compensator_is_recommended_that_leaves_the_test_unstable(best: str) -> None:
    """It said `use ats` above a column of P(unstable) = 1."""
    found = ag.rths(structure(-0.05), posterior(), draws=10)
    assert found.p_unstable.value == 1.0
    compared = Comparison({'none': found, 'ats': found}, best)
    for text in (compared.summary(), repr(compared)):
        assert text.startswith('no compensator is likely to keep this test stable')
        assert 'use ' not in text.splitlines()[0]


def test_comparing_compensators_shows_how_far_it_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """After each of them; on the command line, too."""
    from actuator_glue.api import compensation
    from actuator_glue.cli import rths as command

    found = ag.rths('sdof', posterior(), draws=10)
    monkeypatch.setattr(compensation, 'rths', lambda *_, **__: found)
    shares: list[float] = []
    ag.compare_compensators('sdof', posterior(), progress=shares.append)
    assert shares == pytest.approx([0.2, 0.4, 0.6, 0.8, 1.0])
    shown: list[float] = []
    bar = nullcontext(shown.append)
    monkeypatch.setattr(command, 'progress', lambda title, total: bar)
    path = str(posterior().save(tmp_path / 'posterior.npz'))
    main(['rths', 'sdof', '--posterior', path, '--compensator', 'best'])
    assert shown == shares


@pytest.mark.parametrize(
    ('array', 'value', 'told'),
    [
        ('draws', np.full((5, 4, 4), np.nan), 'NaN or infinite'),
        ('draws', np.empty((0, 4, 4)), r'shape \(0, 4, 4\)'),
        ('draws', np.ones((5, 4, 3)), r'shape \(5, 4, 3\)'),
        ('draws', np.ones(4), r'shape \(4,\)'),
        ('best', np.array([1.0, np.inf, 1.0, 1.0]), 'NaN or infinite'),
        ('best', np.ones(3), r'shape \(3,\)'),
        ('log_density', np.ones((2, 4)), r'shape \(2, 4\)'),
        ('log_density', np.full((250, 4), np.nan), 'NaN'),
        ('sketches', (np.ones(3),), r'shape \(3,\)'),
        ('draws', np.full((250, 4, 4), 'x'), 'no numbers'),
    ],
)
def test_a_file_of_broken_arrays_is_refused(
    tmp_path: Path, array: str, value: object, told: str
) -> None:
    """It names the file and the array, instead of an answer from nothing or a fault later on."""
    broken = replace(posterior(), **{array: value})
    path = store.save(tmp_path / 'posterior.npz', broken.schema, broken)
    with pytest.raises(ag.InputError, match=rf'posterior\.npz: array {array}.* {told}'):
        ag.Calibration.load(path)


def test_what_is_no_posterior_is_refused_without_advice_to_trust_it(tmp_path: Path) -> None:
    """A file of another kind, as the JSON of the same result."""
    other = tmp_path / 'found.json'
    other.write_text('{}')
    with pytest.raises(ag.InputError, match='it is no') as told:
        ag.Calibration.load(other)
    assert 'pickle' not in str(told.value)


@pytest.mark.filterwarnings('error')
def test_draws_that_bear_any_delay_are_told() -> None:
    """Some of the draws have no margin: their number is said, none is told of the others."""
    specimen = ag.Specimen(0.0, 0.0, 4000.0, {'stiffness': 100.0})
    soft = ag.Partition(1000.0, 628.0, 35500.0, specimen, 1000.0)
    found = ag.rths(soft, posterior(effects=('delay',)))
    endless = int(np.isinf(found.margins_drawn).sum())
    assert 0 < endless < found.draws and found.margin_s is None
    assert f'{endless} of {found.draws} draws bear any delay' in ' '.join(found.notes)
    certain = ag.rths(structure(0.4), posterior())
    assert certain.margin_s is not None and 'any delay' not in ' '.join(certain.notes)


def test_two_draws_do_not_say_what_the_margin_follows() -> None:
    """It varies all the same."""
    assert '2 draws are too few' in repr(ag.rths(structure(0.4), posterior(), draws=2))
    assert 'too few' not in repr(ag.rths(structure(0.4), posterior(), draws=50))


@pytest.mark.parametrize('limit', [5.0, -0.1, float('nan')])
def test_a_limit_in_percent_is_no_go_for_everything(limit: float) -> None:
    """5 is no probability: it would let an unstable test go."""
    found = ag.rths(structure(0.01), posterior(), draws=20)
    assert found.p_unstable.value == 1.0 and found.go(1.0) and not found.go(0.05)
    with pytest.raises(ag.InputError, match='limit'):
        found.go(limit)


def test_a_comparison_is_shown_in_notebooks_with_what_forbids_it() -> None:
    """As every result is: a table of HTML, and the problems of its posterior before the advice."""
    sure = ag.rths(structure(0.4), posterior(), draws=10)
    doubted = replace(sure, problems=('its chains stand still',))
    for found, told in ((sure, False), (doubted, True)):
        compared = Comparison({'none': found, 'ats': found}, 'none')
        assert '<table' in compared._repr_html_() and 'use no compensator' in repr(compared)
        assert ('its chains stand still' in compared._repr_html_()) == told
        assert repr(compared).startswith('its chains stand still') == told
