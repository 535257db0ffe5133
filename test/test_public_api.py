"""The public API: what a notebook imports, and that the command line says the same."""

import dataclasses
import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import actuator_glue as ag
from actuator_glue.cli.main import main

NAMES = {
    'ActuatorHistory',
    'Calibration',
    'CampaignResult',
    'Command',
    'DaysCompared',
    'Diagnosis',
    'GroundMotion',
    'InputError',
    'Partition',
    'Record',
    'Replay',
    'Specimen',
    'StabilityResult',
    'calibrate',
    'campaign',
    'combinations',
    'compare',
    'compare_compensators',
    'diagnose',
    'effects',
    'history',
    'join',
    'load',
    'load_records',
    'plot',
    'replay',
    'rths',
    'simulate',
}


@pytest.fixture(scope='module')
def record() -> ag.Record:
    """A short test under a specimen stiffness."""
    return ag.simulate(ag.Command(rate=200.0, duration=20.0), stiffness=250e3, seed=3)


@pytest.fixture(scope='module')
def posterior(record: ag.Record) -> ag.Calibration:
    """A short calibration."""
    return ag.calibrate(record, evaluations=24_000, seed=5)


def test_the_package_shows_its_names() -> None:
    """`dir` shows what there is, and every name can be had."""
    assert set(ag.__all__) == NAMES
    assert set(dir(ag)) == NAMES | {'__version__'}
    for name in NAMES:
        assert getattr(ag, name) is not None
    with pytest.raises(AttributeError, match='nothing'):
        _ = ag.nothing


def test_importing_costs_and_changes_nothing() -> None:
    """No heavy library, no environment variable, no thread; 0.3 s of a core (best of five)."""
    code = (
        'import os, sys, threading, time; before = dict(os.environ); t = time.process_time();'
        'import actuator_glue; t = time.process_time() - t;'
        'heavy = {"numpy", "numba", "scipy", "rclpy", "matplotlib"} & set(sys.modules);'
        'print(t, not heavy, dict(os.environ) == before, threading.active_count())'
    )
    # The bootstrapper of ROS wheels starts Python anew: only the package itself is timed.
    rows = [
        subprocess.run(
            [sys.executable, '-c', code], capture_output=True, text=True, check=True
        ).stdout.split()
        for _ in range(5)
    ]
    assert all(row[1:] == ['True', 'True', '1'] for row in rows)
    assert min(float(row[0]) for row in rows) <= 0.3


def test_a_calibration_is_kept(posterior: ag.Calibration, tmp_path: Path) -> None:
    """What is loaded says what was saved; nothing but arrays and text is in the file."""
    path = posterior.save(tmp_path / 'posterior.npz')
    again = ag.Calibration.load(path)
    assert again.to_json() == posterior.to_json()
    np.testing.assert_array_equal(again.draws, posterior.draws)
    np.testing.assert_array_equal(again.log_density, posterior.log_density)
    with np.load(path, allow_pickle=False) as file:
        assert file['names'].tolist() == list(posterior.parameters)
        assert file['draws'].shape == posterior.posterior.shape
    for wrong in (Path(__file__), tmp_path / 'nothing.npz'):
        with pytest.raises(ag.InputError, match=wrong.name):
            ag.Calibration.load(wrong)


@pytest.mark.usefixtures('undrawn')
def test_a_calibration_is_shown(posterior: ag.Calibration, tmp_path: Path) -> None:
    """Figures, a report, a table for notebooks, and arviz's form of the draws."""
    assert len(posterior.plot().axes) == 16
    assert posterior.plot_bands(posterior.records[0]).axes
    assert 'beta_1' in posterior._repr_html_()
    page = posterior.report(tmp_path / 'report.html').read_text()
    assert 'Posterior moments' in page and page.count('<figure') == 3
    data = posterior.inference_data
    assert data.posterior['beta_1'].attrs['unit'] == '1/s'
    assert data.posterior['beta_1'].attrs['upper'] == 400.0
    steps, chains, _ = posterior.draws.shape
    assert data.posterior['beta_1'].shape == (chains, steps)
    mean = float(data.posterior['alpha_2'].mean())
    assert mean == pytest.approx(posterior.parameters['alpha_2'].mean)


@pytest.mark.usefixtures('undrawn')
def test_a_diagnosis_is_kept_and_shown(
    record: ag.Record, posterior: ag.Calibration, tmp_path: Path
) -> None:
    """The same for a diagnosis, which may begin with what a calibration knew."""
    other = replace(posterior, sketches=())  # as if of another test
    found = ag.diagnose(record, prior=other, prior_age=60.0)
    assert found.prior is not None and found.prior.source == 'a calibration'
    assert not found.prior.contradicted  # it is the same machine's
    assert found.to_json()['tracking'][0]['predicted']['J2']['median'] > 0.0
    again = ag.Diagnosis.load(found.save(tmp_path / 'diagnosis.npz'))
    assert json.dumps(again.to_json()) == json.dumps(found.to_json())
    np.testing.assert_array_equal(again.traces[0].measured, found.traces[0].measured)
    assert again.plot().axes
    page = again.report(tmp_path / 'report.html').read_text()
    assert 'Tracking of' in page and 'prior from a calibration' in page
    assert found.summary().split(':')[0] in found._repr_html_()
    assert set(found.inference_data.posterior) == set(found.names)
    told = found.base | {n: p for e in found.effects for n, p in e.parameters.items()}
    ends = np.quantile(again.posterior, [0.025, 0.975], axis=0).T
    for name, (low, high) in zip(again.names, ends, strict=True):
        assert (told[name].lower, told[name].upper) == (low, high)
    assert set(found.inference_data.groups()) >= {'posterior', 'observed_data', 'constant_data'}
    table = again.to_dataframe()
    assert table.loc['beta_1', 'mean'] == told['beta_1'].mean
    predicted = again.predict(record)
    assert predicted.inside == pytest.approx(0.95, abs=0.02)
    assert predicted.problems == (() if found.complete else (found.summary(),))
    assert len(again.plot_bode(record).axes) == 3
    if not again.effects:
        assert again.transfer_function(250e3).dcgain() == pytest.approx(1.0, abs=0.02)
    assert again.save_mat(tmp_path / 'diagnosis.mat').stat().st_size > 1000
    with pytest.raises(ag.InputError, match='holds'):
        ag.Calibration.load(tmp_path / 'diagnosis.npz')


@pytest.mark.usefixtures('undrawn')
def test_a_replay_is_kept_and_shown(record: ag.Record, tmp_path: Path) -> None:
    """The same for a replay, whose windows may be of a model with an effect of the user's own."""
    effect = ag.effects.term(
        'bent',
        'sensor: y = y + bend*y**2',
        (ag.effects.Parameter('bend', '1/m', -50.0, 50.0, 'bend', 0.0),),
    )
    ag.effects.register(effect)
    try:
        found = dataclasses.replace(ag.replay(record), effects=('bent',))
        assert set(found.to_json()['definitions']) == {'bent'}
        path = found.save(tmp_path / 'replay.npz')
        assert 'nothing published live' in found._repr_html_()
    finally:
        ag.effects.unregister('bent')
    again = ag.Replay.load(path)  # where nobody knows the effect
    ag.effects.unregister('bent')
    assert again.windows == found.windows
    page = dataclasses.replace(again, effects=()).report(tmp_path / 'replay.html').read_text()
    assert page.count('<figure') == 1
    assert f'>{found.windows[-1].end_s:.2f}</td>' in page


def written(tmp_path: Path, *command: object) -> dict[str, object]:
    """Run a command and return its JSON."""
    out = tmp_path / 'out.json'
    assert main([*map(str, command), '--json', str(out), '--force']) in (0, 1)
    return dict(json.loads(out.read_text()))


def test_the_command_line_gives_the_same_numbers(tmp_path: Path) -> None:
    """Defaults included: nothing is said but the file, its stiffness, and fewer evaluations."""
    file = tmp_path / 'test.csv'
    made = ag.simulate(ag.Command(rate=200.0, duration=10.0), stiffness=250e3, seed=2)
    options = '--rate 200 --duration 10 --stiffness 250e3 --seed 2 --unit m'
    code = main(['simulate', str(file), *options.split()])
    assert code == 0
    record = ag.load(file, stiffness=250e3)
    np.testing.assert_array_equal(record.measured, made.measured)
    # How long it took, and by which command and when it was made.
    untimed = {'seconds', 'compile_seconds', 'times_real_time', 'provenance'}
    more = ('--stiffness', '250e3')
    pairs = (
        (
            ag.calibrate(record, evaluations=24_000).to_json(),
            written(tmp_path, 'calibrate', file, *more, '--evaluations', 24_000),
        ),
        (ag.diagnose(record).to_json(), written(tmp_path, 'diagnose', file, *more)),
        (ag.replay(record).to_json(), written(tmp_path, 'replay', file, *more)),
    )
    for ours, theirs in pairs:
        kept = {k: v for k, v in json.loads(json.dumps(ours)).items() if k not in untimed}
        assert kept == {k: v for k, v in theirs.items() if k not in untimed}


def test_unknown_options_are_refused(record: ag.Record) -> None:
    """A misspelt option is an error that names the known ones."""
    with pytest.raises(ag.InputError, match='evaluations'):
        ag.calibrate(record, evaluation=100)
    with pytest.raises(ag.InputError, match='likelihood'):
        ag.calibrate(record, likelihood='guess')
    with pytest.raises(ag.InputError, match='hop'):
        ag.replay(record, hops=1.0)
    with pytest.raises(ag.InputError, match='seed'):
        ag.diagnose(record, seed=-1)


@pytest.mark.usefixtures('undrawn')
def test_the_script_of_the_readme_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """As it stands there, on files that the command line made."""
    text = (Path(__file__).parents[1] / 'README.md').read_text(encoding='utf-8')
    script = text.split('```python\n')[1].split('```')[0]
    monkeypatch.chdir(tmp_path)
    shape = ('--rate', '200', '--duration', '12')
    for name, k, more in (
        ('free', '0', shape),
        ('clamped', '250e3', shape),
        ('earthquake', '250e3', (*shape, '--command', 'earthquake')),
    ):
        assert main(['simulate', f'{name}.csv', '--stiffness', k, *more]) == 0
    exec(compile(script, 'README.md', 'exec'), {})
    said = capsys.readouterr().out
    assert '[]' in said or '()' in said
    assert 'held-out error' in said
    assert (tmp_path / 'posterior.png').stat().st_size > 10_000
    assert 'Diagnosis' in (tmp_path / 'diagnosis.html').read_text()
