"""Learned terms: what no catalogue names is described, and the description travels."""

import json
import math
import re
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from smooth_machines import Array, piston

from actuator_glue import effects
from actuator_glue.api import diagnosis as module
from actuator_glue.api.diagnosis import Diagnosis
from actuator_glue.cli.main import main
from actuator_glue.diagnosis import diagnose as core
from actuator_glue.diagnosis import pipeline
from actuator_glue.diagnosis.learned.forms import forms
from actuator_glue.diagnosis.learned.term import LearnedTerm
from actuator_glue.diagnosis.moves import reserved_effects
from actuator_glue.diagnosis.thresholds import Thresholds
from actuator_glue.errors import InputError
from actuator_glue.model.effects import CATALOGUE, Scale
from actuator_glue.model.structure import Structure
from actuator_glue.records import Record

PLANTS = np.array(
    [[128.0, 1.01e9, 2.42e5, 0.3], [235.0, 5e10, 4.23e6, 3.3], [225.0, 5.3e9, 6e5, 0.3]]
)
NOISE = 1e-5
QUICK = Thresholds(evaluations=0)
NAMES = ('backlash', 'gain', 'sensor-lag', 'specimen-hardening', 'valve-deadband', 'valve-null')
SCALE = Scale(2e-3, 0.1, 60.0, 1 / 256, 250e3, PLANTS[1])


def commands(seconds: float, rate: float, rng: np.random.Generator) -> tuple[Array, Array]:
    """A sweep of 2 mm to 10 Hz, and shaking of that size that grows and decays [m]."""
    t = np.arange(int(seconds * rate)) / rate
    lines = np.arange(0.3, 7.0, 0.1)
    phases = rng.uniform(0.0, 2 * np.pi, len(lines))
    shaking = np.sin(2 * np.pi * np.outer(t, lines) + phases).sum(axis=1)
    shaking *= np.minimum(1.0, t / 6.0) * np.exp(-0.04 * np.maximum(0.0, t - 18.0))
    sweep = 2e-3 * np.sin(np.pi * (10.0 / seconds) * t**2)
    return sweep, np.asarray(2e-3 * shaking / np.abs(shaking).max())


def machine(
    kind: int, size: float, cubic: float, theta: Array, seed: int, rate: float, seconds: float
) -> list[Record]:
    """Two sweeps, without and with a specimen, and shaking that is held out."""
    rng = np.random.default_rng(seed)
    sweep, shaking = commands(seconds, rate, rng)
    out = []
    for command, k in ((sweep, 0.0), (sweep, 250e3), (shaking, 250e3)):
        x = piston(command, 1.0 / rate, theta, k, (kind, size))
        y = x + cubic * (x / 2e-3) ** 3 + NOISE * rng.standard_normal(len(x))
        out.append(Record(command, y, 1.0 / rate, stiffness=k))
    return out


@pytest.fixture(scope='module')
def found() -> Diagnosis:
    """The diagnosis of a cubic transducer, 0.2 mm at 2 mm, of whose name none is tried."""
    records = machine(0, 1.0, 2e-4, PLANTS[1], 1, 128.0, 12.0)
    with pytest.MonkeyPatch.context() as patch:
        for place in (pipeline, reserved_effects):
            patch.setattr(place, 'mean_effects', lambda reserved=False: () if reserved else NAMES)
        plain = core.diagnose(records[:2], records[2], settings=replace(QUICK, most=1))
    return Diagnosis(**{f.name: getattr(plain, f.name) for f in fields(plain)})


def test_a_cubic_transducer_is_described(found: Diagnosis) -> None:
    """Equation, size, range and held-out error; the name has no probability."""
    assert found.verdict == 'missing-effect'
    assert found.structure == ('learned-sensor-y3',)
    assert found.history[0].effects == () and found.history[-1].what == 'learned terms'
    assert found.history[-1].effects == found.structure
    assert found.error.after < 1.1 * NOISE < 0.8 * found.error.before
    (term,) = found.learned
    (size,) = term.parameters.values()
    assert size.lower < 2e-4 / 2e-3**3 < size.upper
    assert size.unit == '1/m^2'
    told = float(found.best[list(found.names).index('sensor_y3')])
    assert term.best == {'sensor_y3': told}
    assert term.numbers == f'y = y + {told:.4g}*y**3'  # whose error is told
    low, high = term.excited['y']
    assert -2.6e-3 < low < -1.8e-3 < 1.8e-3 < high < 2.6e-3
    assert f'a learned term learned-sensor-y3 ({term.numbers})' in found.summary()
    assert f'95 % {size.lower:.4g} to {size.upper:.4g}' in found.advice[0]
    assert any('the name nearest to learned-sensor-y3 is' in line for line in found.advice)
    content = json.loads(json.dumps(found.to_json()))
    assert content['effects'][0]['probability'] is None
    assert content['learned'][0]['expression'] == term.numbers
    assert content['learned'][0]['parameters'].keys() == term.parameters.keys()


def test_a_learned_term_travels(found: Diagnosis, tmp_path: Path) -> None:
    """By file, by JSON and by .npz; nothing is registered before somebody asks for it."""
    assert 'learned-sensor-y3' not in CATALOGUE
    again = Diagnosis.load(found.save(tmp_path / 'found.npz'))
    assert again.learned == found.learned
    definition = json.loads(json.dumps(found.to_json()))['definitions']
    path = again.save_effects(tmp_path / 'learned.yaml')
    (effect,) = effects.read_effects(path)
    assert effect == found.learned[0].effect
    assert definition == {effect.name: found.learned[0].definition}
    record = Record(np.linspace(0.0, 1e-3, 200), np.zeros(200), 1e-2, stiffness=0.0)
    expected = found.model.simulate(found.best, record)
    effects.load_effects(path)
    try:
        known = Structure([effect.name])
        assert (known.simulate(found.best, record) == expected).all()
        # What is in the catalogue now is not learned a second time.
        assert effect.name not in [e.name for e in forms(SCALE, CATALOGUE)]
    finally:
        effects.unregister(effect.name)


@pytest.mark.usefixtures('undrawn')
def test_a_report_shows_the_equation(found: Diagnosis, tmp_path: Path) -> None:
    """The equation of an effect that no catalogue has."""
    text = found.report(tmp_path / 'report.html').read_text()
    assert 'sensor_y3*y**3' in text


def test_nothing_learned_is_nothing_written(found: Diagnosis, tmp_path: Path) -> None:
    """A file without effects could not be read again."""
    found = Diagnosis(**{f.name: getattr(found, f.name) for f in fields(found)} | {'learned': ()})
    with pytest.raises(InputError, match='no term was learned'):
        found.save_effects(tmp_path / 'none.yaml')


def test_forms_are_scaled_to_the_test() -> None:
    """Names differ, all parameters vanish at zero and start where they change some per cent."""
    offered = forms(SCALE)
    assert len({e.name for e in offered}) == len(offered) > 30
    for effect in offered:
        for row in effect.starts(SCALE):
            values = zip(row, effect.parameters, strict=True)
            assert all(p.lower <= v <= p.upper for v, p in values)
    units = {e.name: e.parameters[0].unit for e in offered}
    assert units['learned-sensor-y3'] == '1/m^2'
    assert units['learned-force-v-absv'] == 'N s^2/m^2'
    assert units['learned-flow-f-absf'] == '1/(N s)'
    assert units['learned-specimen-k-v'] == 's'


def test_without_a_specimen_no_form_needs_its_force() -> None:
    """There is no force that a leak could follow."""
    free = Scale(2e-3, 0.1, 60.0, 1 / 256, 0.0, PLANTS[1])
    words = [e.equation for e in forms(free)]
    assert not any(re.search(r'\bk\b|[*(]f\b', text) for text in words)


def test_a_sentence_names_no_cause() -> None:
    """The range is that of the symbols in the equation."""
    term = LearnedTerm('learned-x', 'sensor', 'y = y', 'y = y', {}, {}, {'y': (-1e-3, 2e-3)}, {})
    assert 'a description, not valid beyond y from -0.001 to 0.002 m' in term.sentence()


@pytest.mark.slow
@pytest.mark.parametrize('seed', [1, 2, 3])
@pytest.mark.parametrize('kind', ['saturation', 'damping'])
def test_smooth_unknowns_are_predicted(kind: str, seed: int) -> None:
    """Held-out error within 1.2 of the noise, whatever the term is called."""
    rng = np.random.default_rng([seed, 5])
    theta = PLANTS[seed % 3] * np.exp(0.1 * rng.standard_normal(4))
    share = rng.uniform(0.0, 1.0)
    error = theta[0] * (theta[2] + 125e3) / theta[1] * 0.125
    which, size = {
        'saturation': (1, (0.4 + 0.4 * share) * error),
        'damping': (3, (0.1 + 0.3 * share) * theta[2] * 2e-3 / 0.125**2),
    }[kind]
    records = machine(which, size, 0.0, theta, seed, 256.0, 40.0)
    found = core.diagnose(records[:2], records[2], settings=QUICK)
    assert found.verdict in ('missing-effect', 'unexplained')
    assert found.error.after < 1.2 * NOISE
    assert all(math.isnan(e.probability) for e in found.effects if e.name.startswith('learned'))


def test_the_command_saves_what_was_learned(
    found: Diagnosis, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """`--save-effects` writes a file of effects where a term was learned, else none."""
    record = tmp_path / 'r.csv'
    t = np.arange(0.0, 10.0, 0.01)
    rows = np.column_stack([t, np.sin(t), 0.9 * np.sin(t - 0.1)])
    np.savetxt(record, rows, delimiter=',', header='time_s,command_mm,measured_mm', comments='')
    without = Diagnosis(
        **{f.name: getattr(found, f.name) for f in fields(found)} | {'learned': (), 'effects': ()}
    )
    for answer, written in ((found, True), (without, False)):
        monkeypatch.setattr(module, 'diagnose', lambda *_, answer=answer, **__: answer)
        out = tmp_path / f'{written}.yaml'
        main(['diagnose', str(record), '--stiffness', '0', '--save-effects', str(out)])
        assert out.exists() is written
    (effect,) = effects.read_effects(tmp_path / 'True.yaml')
    assert effect.name == found.learned[0].name
