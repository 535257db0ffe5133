"""Effects from outside the package: simulated, calibrated, diagnosed, reported."""

from __future__ import annotations

import json
import queue
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from actuator_glue import effects
from actuator_glue.cli.main import main
from actuator_glue.diagnosis.diagnose import diagnose
from actuator_glue.diagnosis.thresholds import Thresholds
from actuator_glue.errors import InputError
from actuator_glue.inference.choice import choose_model
from actuator_glue.model.effects import CATALOGUE
from actuator_glue.model.structure import Structure
from actuator_glue.online import conversion
from actuator_glue.online.settings import EstimatorSettings
from actuator_glue.records import Record
from actuator_glue.report import html
from actuator_glue.report.diagnosis_report import page
from actuator_glue.workers.worker import DONE, Answer, Worker

CUBIC = """\
bent-sensor:
  sensor: y = y + bend*y**2 + cubic*y**3
  parameters:
    bend: {unit: 1/m, bounds: [-50, 50], neutral: 0, meaning: even part}
    cubic: {unit: 1/m^2, bounds: [-4e4, 4e4], neutral: 0, meaning: odd part}
  source: a laboratory's own
"""


@pytest.fixture(autouse=True)
def _catalogue_as_it_was() -> Iterator[None]:
    yield
    for effect in CATALOGUE.registered():
        CATALOGUE.unregister(effect.name)


@pytest.fixture
def own(tmp_path: Path) -> str:
    """Return the path of an effects file."""
    path = tmp_path / 'own.yaml'
    path.write_text(CUBIC)
    return str(path)


def test_simulate_and_calibrate(own: str, tmp_path: Path) -> None:
    """What was simulated with an effect of the file is found by a calibration with it."""
    bag, out, draws = (str(tmp_path / n) for n in ('made.csv', 'fit.json', 'draws.npz'))
    made = ['--effect', 'bent-sensor:bend=10,cubic=8e3', '--rate', '128', '--duration', '12']
    given = ['--effects-file', own]
    assert main(['simulate', bag, *given, *made, '--stiffness', '250e3']) == 0
    truth = json.loads((tmp_path / 'made.csv.truth.json').read_text())
    assert truth['theta']['cubic'] == 8e3 and 'bent-sensor' in truth['definitions']
    fit = ['calibrate', bag, '--stiffness', '250e3', '--effect', 'bent-sensor', '--draws', draws]
    CATALOGUE.unregister('bent-sensor')
    assert main([*fit, '--json', out]) == 2, 'not known without its file'
    options = ['--evaluations', '24000', '--likelihood', 'gaussian', '--json', out]
    assert main([*fit, *given, *options]) == 0
    content = json.loads(Path(out).read_text())
    found = content['parameters']
    assert found['bend']['mean'] == pytest.approx(10.0, abs=1.0)
    assert found['cubic']['mean'] == pytest.approx(8e3, abs=1e3)
    assert content['definitions']['bent-sensor']['parameters']['bend']['unit'] == '1/m'
    CATALOGUE.unregister('bent-sensor')
    plots = str(tmp_path / 'plots')
    assert main(['plot', bag, '--stiffness', '250e3', '--draws', draws, '--out', plots]) == 0
    assert 'bent-sensor' in CATALOGUE, 'the draws say what they are of'


@pytest.mark.slow
@pytest.mark.usefixtures('undrawn')
def test_diagnose_and_report(own: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The diagnosis names it among the whole catalogue; the report shows its equation."""
    effects.load_effects(own)
    # The catalogue's entry of the same form would tie with it.
    others = tuple(n for n in CATALOGUE.searched() if n != 'sensor-curve')
    monkeypatch.setattr(
        type(CATALOGUE), 'searched', lambda self, reserved=False: () if reserved else others
    )
    rate, rng = 128.0, np.random.default_rng(3)
    t = np.arange(int(24 * rate)) / rate
    sweep, theta = 2e-3 * np.sin(np.pi * (10.0 / 24.0) * t**2), [235.0, 5.0e10, 4.23e6, 3.3]
    records = []
    for k in (0.0, 250e3):
        record = Record(sweep, sweep, 1 / rate, stiffness=k)
        y = Structure(('bent-sensor',)).simulate([*theta, 20.0, 1e4], record)
        records.append(replace(record, measured=y + 1e-5 * rng.standard_normal(len(t))))
    found = diagnose(records, settings=Thresholds(evaluations=0))
    assert [e.name for e in found.effects] == ['bent-sensor']
    assert found.effects[0].parameters['bend'].mean == pytest.approx(20.0, rel=0.1)
    report = tmp_path / 'report.html'
    html.write(report, page(found))
    assert 'bend*y**2' in report.read_text()


def test_a_bag_says_what_its_model_is(own: str) -> None:
    """EstimatorSetup holds the definition: a replay needs no file."""
    effects.load_effects(own)
    settings, model = EstimatorSettings(), choose_model(('bent-sensor',))
    message = SimpleNamespace(**conversion.estimator_setup(settings, model, 0, 0))
    CATALOGUE.unregister('bent-sensor')
    assert conversion.model_choice(message) == model
    assert conversion.estimator_settings(message) == settings
    plain = conversion.estimator_setup(settings, choose_model(('delay',)), 0, 0)
    assert 'definitions' not in json.loads(plain['settings'])


def _names(tell: object) -> list[str]:
    return [effect.name for effect in CATALOGUE.registered()]


@pytest.mark.slow
def test_a_worker_process_knows_them(own: str) -> None:
    """Also those registered after it began."""
    answers: queue.Queue[Answer] = queue.Queue()
    worker = Worker(answers.put, None)
    try:
        effects.load_effects(own)
        worker.submit(_names)
        assert answers.get(timeout=60.0)[:2] == (DONE, ['bent-sensor'])
    finally:
        worker.close()


def test_saved_effects_are_read_back(own: str, tmp_path: Path) -> None:
    """As YAML, as they were; an effect with a stage of its own is no expression."""
    made = effects.load_effects(own)
    again = tmp_path / 'again.yaml'
    effects.save_effects(again, made)
    assert effects.read_effects(again) == made
    with pytest.raises(InputError, match='not written as an expression'):
        effects.save_effects(again, [CATALOGUE['delay']])


def test_an_edited_file_replaces_what_was_loaded(own: str) -> None:
    """In one session, as in a notebook."""
    effects.load_effects(own)
    Path(own).write_text(CUBIC.replace('[-50, 50]', '[-5, 5]'))
    effects.load_effects(own)
    assert Structure(('bent-sensor',)).bounds()[1][4] == 5.0


@pytest.mark.parametrize(
    ('name', 'text', 'why'),
    [
        ('a.yaml', 'bent: [', 'line 1'),
        ('a.yaml', CUBIC.replace('y**2', 'z**2'), "column 22: 'z' is not known"),
        ('a.yaml', CUBIC.replace('bent-sensor', 'bias'), "'bias' is there already"),
        ('a.yaml', CUBIC.replace('cubic', 'delay'), 'belongs to delay'),
        ('a.py', 'import os\n', 'line 1: the file is read, not executed'),
        ('a.py', 'EFFECTS = {"a": open("/etc/passwd")}\n', 'line 1: the file is read'),
        ('a.py', 'EFFECTS = {', 'line 1'),
        ('missing.yaml', None, 'cannot be read'),
    ],
)
def test_files_that_cannot_be_used(
    name: str, text: str | None, why: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """One error with file and position, exit code 2."""
    if text is not None:
        (tmp_path / name).write_text(text)
    path = str(tmp_path / name)
    assert main(['simulate', str(tmp_path / 'out.csv'), '--effects-file', path]) == 2
    error = capsys.readouterr().err
    assert name in error and why in error


def test_a_python_file_of_literals(tmp_path: Path) -> None:
    """Read, not executed."""
    path = tmp_path / 'own.py'
    path.write_text(
        '"""Our valve."""\n'
        'EFFECTS = {"soft-valve": {"valve": "e = tanh(e/knee)*knee",\n'
        '    "parameters": {"knee": {"unit": "m", "bounds": [1e-4, 1.0], "neutral": 1.0}}}}\n'
    )
    assert [e.name for e in effects.load_effects(path)] == ['soft-valve']
