"""What holds where the specimen's stiffness is not known, against the truth that was simulated."""

import html
import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy

import actuator_glue as ag
from actuator_glue.api.calibration_parts import marginals
from actuator_glue.api.combinations import Combinations
from actuator_glue.api.combinations_data import COMBINATIONS
from actuator_glue.cli.main import main
from actuator_glue.errors import InputError
from actuator_glue.io.export import write
from actuator_glue.report.quantity import plain

# Table 2 of the paper with a leakage that shows.
THETA = np.array([116.0, 9.0e8, 2.4e5, 8.0])
ORDER = (
    'the specimen stiffness is not known',
    'How sure: +-',
    'rms [um]',
    'Parameters before',
    'Delay: ',
    'Next: actuator-glue',
    'b, a and c of x/u',
    'Tracking of',
)
SHORT = {'evaluations': 16_000, 'seed': 2}


def simulated(stiffness: float, seed: int = 7) -> ag.Record:
    """Return a test with a leak."""
    command = ag.Command(rate=250.0, duration=20.0)
    return ag.simulate(command, stiffness=stiffness, theta=THETA, seed=seed)


def truth(k: float) -> np.ndarray:
    """Return the combinations of the simulated actuator."""
    beta_1, loop, oil, leak = THETA
    share = leak * k / (oil + k)
    return np.array([loop / (oil + k), beta_1 + share, beta_1 * share])


@pytest.mark.parametrize('stiffness', [0.0, 120e3, 700e3])
def test_the_combinations_are_those_of_the_actuator(stiffness: float) -> None:
    """Whatever the stiffness is; what the record says of it is left aside."""
    record = replace(simulated(stiffness), force=None)
    found = ag.combinations(record, **SHORT)
    assert list(found.combinations) == list(COMBINATIONS)
    mean = np.array([p.mean for p in found.combinations.values()])
    spread = np.array([p.stddev for p in found.combinations.values()])
    off = np.abs(mean - truth(stiffness)) / spread
    if stiffness == 0.0:
        off = off[:2]  # nothing is below 0, where the third one lies
        assert found.combinations['beta_1 alpha_3 k / (alpha_2 + k)'].best < 0.02 * truth(0.0)[0]
    assert (off < 4.0).all()
    assert (spread[:2] < 0.02 * mean[:2]).all()
    assert found.problems == ()
    assert 'it predicts no other stiffness' in found.notes[0]
    assert found.sources[0].stiffness_n_per_m is None


def test_errors_may_be_correlated() -> None:
    """The parameter of their likelihood is told as of every calibration."""
    found = ag.combinations(simulated(250e3), likelihood='ar1', **SHORT)
    assert list(found.combinations) == [*COMBINATIONS, 'phi']
    assert found.combinations['phi'].unit == '1' and found.combinations['phi'].bounds[1] < 1.1
    assert len(found.residuals[0]) == len(found.records[0])


def test_an_effect_that_stays_as_wide_as_its_prior_is_told() -> None:
    """Combinations have no bounds that they could fill."""
    rng = np.random.default_rng(4)
    draws = rng.uniform(size=(400, 3, 2)) * [2.0, 1.0]
    units, bounds = {'b': '1/s^2', 'gain': '1'}, [(0.0, np.inf), (0.0, 1.0)]
    told = marginals(draws, draws[0, 0], units, bounds)
    assert [p.prior_dominated for p in told.values()] == [False, True]
    assert told['gain'].mean == pytest.approx(0.5, abs=0.05) and told['gain'].unit == '1'


@pytest.mark.usefixtures('undrawn')
def test_what_it_is_told_and_kept(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """By the command line as by the library; the force says what the stiffness may be."""
    write(tmp_path / 'a.csv', replace(simulated(250e3), source='a.csv'))
    options = ['--stiffness', 'unknown', '--evaluations', '16000', '--seed', '2']
    places = ['--json', str(tmp_path / 'a.json'), '--save', str(tmp_path / 'a.npz')]
    places += ['--report', str(tmp_path / 'a.html')]
    assert main(['calibrate', str(tmp_path / 'a.csv'), *options, *places]) == 0
    said = capsys.readouterr()
    assert 'beta_1 + alpha_3 k / (alpha_2 + k)' in said.out
    assert 'force over displacement is 2.5' in said.err
    told = json.loads((tmp_path / 'a.json').read_text())
    assert told['records'][0]['stiffness_n_per_m'] is None
    kept = Combinations.load(tmp_path / 'a.npz')
    assert kept.to_json()['combinations'] == told['combinations']
    table = kept.to_dataframe()
    for name, p in kept.combinations.items():
        assert p.mean == told['combinations'][name]['mean'] == table['mean'][name]
    page = (tmp_path / 'a.html').read_text()
    assert 'no hybrid test' in page
    assert not kept.records and not kept.residuals
    # The same things in the same order as of every calibration; a picture before any table.
    words = re.sub(r'<style.*?</style>|data:image[^"]*|<[^>]*>', '', page, flags=re.DOTALL)
    for text in (said.out, html.unescape(words)):
        places = [text.index(part) for part in ORDER]
        assert places == sorted(places)
    assert page.index('How sure') < page.index('<img') < page.index('<table')
    assert said.out.startswith('the model fits: ')
    rms = f'{1e6 * told["error"]["rms_m"]:.1f}'
    assert re.search(rf'after: the best draw +{rms} *\n', said.out)
    (following,) = re.findall(r'Next: (.*)', said.out)
    assert re.fullmatch(
        rf'actuator-glue calibrate {tmp_path}/a.csv --stiffness 2[45]\d000'
        r' --evaluations 16000 --seed 2',
        following,
    )
    for name, p in kept.combinations.items():
        low, high = np.quantile(
            kept.posterior[:, list(kept.combinations).index(name)], [0.025, 0.975]
        )
        assert f'({plain(low, 4)} to {plain(high, 4)})' in said.out
        assert p.unit in ('1/s', '1/s^2')
    # Others ask for the stiffness, and say what there is without.
    assert main(['diagnose', str(tmp_path / 'a.csv'), '--stiffness', 'unknown']) == 2
    assert '`calibrate --stiffness unknown` tells what holds' in capsys.readouterr().err


def test_structure_is_told_with_what_can_be_done_without_a_stiffness() -> None:
    """`diagnose` needs the stiffness: nobody is sent there without one."""
    command = ag.Command(rate=200.0, duration=10.0)
    record = ag.simulate(
        command, stiffness=250e3, effects={'backlash': {'backlash': 2e-4}}, seed=3
    )
    found = ag.combinations(record, evaluations=8000)
    (first, *_) = found.problems
    assert first.endswith('with the stiffness, `actuator-glue diagnose` tells what is missing')
    assert 'on the same records' not in ' '.join(found.problems)


def test_what_needs_a_stiffness_is_refused(tmp_path: Path) -> None:
    """A mass, the force as evidence, records of which one has a stiffness."""
    record = simulated(250e3)
    with pytest.raises(InputError, match='mass cannot be told'):
        ag.combinations(record, effects='payload-inertia')
    with pytest.raises(InputError, match='need the specimen stiffness'):
        ag.combinations(record, use_force=True)
    for name in ('a.csv', 'b.csv'):
        write(tmp_path / name, record)
    words = ['calibrate', str(tmp_path / 'a.csv'), str(tmp_path / 'b.csv'), '--stiffness']
    assert main([*words, '0', 'unknown']) == 2


@pytest.mark.slow
def test_a_shaking_table_is_a_free_actuator_with_a_payload() -> None:
    """A rigid payload has no stiffness: --stiffness 0 and the mass that moves along."""
    command = ag.Command(rate=250.0, duration=20.0)
    table = ag.simulate(command, stiffness=0.0, effects=['payload-inertia'], seed=9)
    plain = ag.calibrate(table, **SHORT)
    found = ag.calibrate(table, effects='payload-inertia', evaluations=80_000, seed=2)
    assert found.error.rms_m < 0.2 * plain.error.rms_m
    assert found.error.rms_m == pytest.approx(1e-5, rel=0.1)


@pytest.mark.parametrize('unknown', [False, True])
def test_draws_are_saved_for_matlab(
    unknown: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """By the suffix, as `save_mat` writes them: the response of the model is that of the draws."""
    write(tmp_path / 'a.csv', simulated(250e3))
    words = ['calibrate', str(tmp_path / 'a.csv'), '--evaluations', '16000', '--stiffness']
    words.append('unknown' if unknown else '250e3')
    for name in ('a.csv.gz', 'a.txt', 'draws'):
        assert main([*words, '--save', str(tmp_path / name)]) == 2
        assert 'saved as .npz, for `plot`' in capsys.readouterr().err
        assert not (tmp_path / name).exists()
    out = tmp_path / 'a.mat'
    assert main([*words, '--save', str(out), '--json', str(tmp_path / 'a.json')]) in (0, 1)
    kept = scipy.io.loadmat(out)
    told = json.loads((tmp_path / 'a.json').read_text())
    sizes = told['combinations' if unknown else 'parameters']
    assert [str(n[0]) for n in kept['names'].ravel()] == list(sizes)
    np.testing.assert_allclose(kept['mean'].ravel(), [p['mean'] for p in sizes.values()])
    model = kept['model'][0, 0]
    assert np.isnan(model['stiffness']).all() if unknown else model['stiffness'] == 250e3
    assert len(model['num_draws']) == len(kept['draws'])
    # Both are x/u of the one specimen that was tested.
    s = 2j * np.pi * 3.0
    b, a, c = truth(250e3)
    answer = np.polyval(model['num'].ravel(), s) / np.polyval(model['den'].ravel(), s)
    assert answer == pytest.approx(b / (s**2 + a * s + b + c), rel=0.01)
