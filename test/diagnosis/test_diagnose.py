"""Whole diagnoses of short simulated tests: effect named, healthy machine left alone."""

import json
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

from actuator_glue.diagnosis import thresholds
from actuator_glue.diagnosis.diagnose import diagnose
from actuator_glue.diagnosis.search import fitting_verdict
from actuator_glue.diagnosis.thresholds import Thresholds
from actuator_glue.errors import InputError
from actuator_glue.model.commands import sweep
from actuator_glue.model.effects import CATALOGUE
from actuator_glue.model.structure import Structure
from actuator_glue.records import Record

RATE = 128.0
THETA = np.array([235.0, 5.0e10, 4.23e6, 3.3])
T = np.arange(int(24 * RATE)) / RATE
SWEEP = 2e-3 * np.sin(np.pi * (10.0 / 24.0) * T**2)
QUICK = Thresholds(evaluations=0)


@pytest.fixture
def sharp(monkeypatch: pytest.MonkeyPatch) -> None:
    """Four tenths of the noise matter, not half."""
    monkeypatch.setattr(thresholds, 'NOISE_SHARE', 0.4)


def make(
    effects: Sequence[str], sizes: Sequence[float], seed: int, seconds: float = 24.0
) -> list[Record]:
    """Two sweeps and a held-out record of another kind, 10 um of noise."""
    rng, time = np.random.default_rng(seed), np.arange(int(seconds * RATE)) / RATE
    sweep = 2e-3 * np.sin(np.pi * (10.0 / seconds) * time**2)
    shaking = np.cumsum(rng.standard_normal(len(time)))
    shaking = np.convolve(shaking - np.convolve(shaking, np.ones(129) / 129, 'same'), [0.5, 0.5])
    shaking = 2e-3 * np.sin(time / 4) * shaking[: len(time)] / np.abs(shaking).max()
    model = Structure(effects)
    out = []
    for command, k in ((sweep, 0.0), (sweep, 250e3), (shaking, 250e3)):
        silent = Record(command, command, 1 / RATE, stiffness=k)
        y = model.simulate(np.append(THETA, sizes), silent)
        y = y + 1e-5 * rng.standard_normal(len(time))
        out.append(Record(command, y, 1 / RATE, stiffness=k))
    return out


@pytest.mark.usefixtures('few_forms')
def test_a_healthy_machine_is_left_alone() -> None:
    """Noise alone, with 20 N of friction: immaterial."""
    a, b, held = make(['coulomb-friction'], [20.0], 11, 12.0)
    found = diagnose([a, b], held, settings=QUICK)
    assert found.verdict == 'none'
    assert found.effects == ()
    assert found.structure == ()
    assert found.error.before == found.error.after
    assert found.error.after == pytest.approx(1e-5, rel=0.1)


@pytest.mark.slow
def test_friction_that_may_fall_with_velocity_has_an_alternative() -> None:
    """Coulomb friction: Stribeck friction at a ratio of one is it, and is not excluded.

    The note's limit is the alternative's, in the JSON too.
    """
    a, b, held = make(['coulomb-friction'], [250.0], 14)
    found = diagnose([a, b], held, settings=QUICK)
    (friction,) = found.effects
    assert friction.name == 'coulomb-friction'
    assert friction.alternatives == ('stribeck-friction',)
    richer = next(r for r in friction.rivals if r.name == 'stribeck-friction')
    assert richer.tied and richer.limit is not None
    name, limit = richer.limit
    assert name == 'breakaway_ratio' and 1.0 < limit < 1.5
    (note,) = [line for line in found.advice if 'is not excluded' in line]
    assert note == (
        'stribeck-friction, which is coulomb-friction at breakaway_ratio = 1, is not excluded: '
        f'breakaway_ratio may be as far as {limit:.3g} (95 %)'
    )
    told = json.loads(json.dumps(found.to_json()))['effects'][0]['rivals']
    assert {'parameter': name, 'limit': limit} in [r['limit'] for r in told]


@pytest.mark.slow
def test_held_out_records_that_contradict_are_undecided() -> None:
    """A transducer set differently for that test alone: headline, verdict and notes say so."""
    a, b, held = make([], [], 13)
    agrees = diagnose([a, b], held, settings=QUICK)
    found = diagnose([a, b], replace(held, measured=1.1 * held.measured), settings=QUICK)
    assert (agrees.verdict, agrees.complete) == ('none', True)
    assert (found.verdict, found.complete) == ('undecided', False)
    assert found.error.after > 1.5 * found.error.noise_floor
    assert found.summary().startswith('undecided')
    assert f'{1e6 * found.error.after:.1f} um' in found.summary()
    assert any('held-out part leaves' in line for line in found.advice)
    assert not any('held-out part leaves' in line for line in agrees.advice)


@pytest.mark.usefixtures('few_forms', 'few_names')
def test_noise_of_the_measurement_is_no_missing_effect() -> None:
    """Jitter of the clock removes no error: it is told as a part of the noise."""
    rng = np.random.default_rng(18)
    records = []
    for record in make([], [], 17):
        slope = np.gradient(np.asarray(record.measured), T)
        late = 3e-4 * rng.standard_normal(len(T))
        records.append(replace(record, measured=record.measured + slope * late))
    found = diagnose(records[:2], records[2], settings=QUICK)
    assert [e.name for e in found.effects] == ['timing-jitter']
    assert found.effects[0].error_with == found.effects[0].error_without
    assert found.summary().startswith('the model is enough')
    assert f'{1e6 * (found.effects[0].noise or 0.0):.1f} um by timing-jitter' in found.summary()
    assert found.complete


@pytest.mark.slow
def test_an_effect_pressed_against_its_bound_is_told_first() -> None:
    """A valve further off its null than the catalogue allows: the size is that of the bound."""
    furthest = CATALOGUE['valve-null'].parameters[0].upper
    a, b, held = make(['valve-null'], [1.3 * furthest], 19)
    found = diagnose([a, b], held, settings=Thresholds(evaluations=2000))
    (held_at,) = [p for p in found.at_bound if not p.physical]
    assert (held_at.name, held_at.side, held_at.bound) == ('null_offset', 'upper', furthest)
    assert 'null_offset is pressed against the upper bound' in found.advice[0]
    assert found.to_json()['at_bound'][0]['name'] == 'null_offset'


@pytest.mark.usefixtures('few_forms')
def test_play_is_named_and_removed() -> None:
    """60 um of play: the name, its size within 3 %, and the error down to the noise."""
    a, b, held = make(['backlash'], [6e-5], 12, 12.0)
    stages: list[str] = []
    found = diagnose([a, b], held, progress=lambda s, x: stages.append(s), settings=QUICK)
    assert found.verdict == 'missing-effect'
    assert [e.name for e in found.effects] == ['backlash']
    assert found.effects[0].alternatives == ()
    estimate = found.effects[0].parameters['backlash']
    assert estimate.mean == pytest.approx(6e-5, rel=0.03)
    assert estimate.lower > 0.0
    assert found.error.before > 1.5 * found.error.after
    assert found.error.after == pytest.approx(1e-5, rel=0.1)
    assert found.coverage[1] == pytest.approx(0.95, abs=0.03)
    assert found.coverage[0] < 0.85
    # A sham effect of equal size must not do what the real one does.
    assert found.error.sham > 1.4 * found.error.after
    assert {'base fit', 'effect 1', 'held-out', 'done'} <= set(stages)
    out = json.loads(json.dumps(found.to_json(), allow_nan=False))
    assert out['schema'] == 'actuator_glue.diagnosis/1'
    assert set(out) >= {
        'verdict',
        'effects',
        'error',
        'candidates',
        'coverage',
        'advice',
        'seconds',
    }
    assert set(out['error']) >= {
        'unit',
        'split',
        'before',
        'before_ci',
        'after',
        'after_ci',
        'noise_floor',
        'removable_removed',
    }
    assert out['candidates'][0]['name'] == 'backlash'


@pytest.mark.slow
@pytest.mark.usefixtures('few_forms', 'sharp')
def test_a_name_that_a_regression_beats_is_doubted() -> None:
    """A command gain that depends on its rate: no effect of the catalogue, small enough to pass.

    A linear effect is named for it; what v|v| explains by 50 nats and more better than the name
    is not the name's doing.
    """
    found = diagnose(rate_gain(), settings=QUICK)
    assert found.verdict == 'unexplained'
    assert not found.complete
    # It takes error away and stays, but it is said that it may stand for something else.
    assert not any(e.probability >= 0.5 for e in found.effects)  # a learned term has none
    assert any('may stand for' in line for line in found.advice)
    assert found.surrogate['features'][0] == 'd/dt loop(v|v|)'
    assert found.surrogate['nats'] > 40.0


@pytest.mark.slow
@pytest.mark.usefixtures('sharp')
def test_what_a_regression_explains_better_is_described() -> None:
    """Of all forms the right one is learned: half a second per metre."""
    found = diagnose(rate_gain(), settings=QUICK)
    assert [e.name for e in found.effects] == ['learned-command-u-absr']
    assert found.complete
    # The gradient over two samples is less than the rate over one.
    assert found.effects[0].parameters['command_u_absr'].mean == pytest.approx(0.5, rel=0.2)


@pytest.mark.slow
@pytest.mark.usefixtures('few_forms', 'sharp')
def test_without_the_surrogate_the_name_is_trusted(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is doubted of the same machine is the surrogate's doing."""
    monkeypatch.setattr(fitting_verdict, 'BEATEN_SHARE', 1.0)
    trusting = diagnose(rate_gain(), settings=QUICK)
    assert trusting.verdict == 'missing-effect'


def rate_gain() -> list[Record]:
    """Two sweeps of a machine whose command gain depends on the command's rate."""
    rng = np.random.default_rng(21)
    rated = SWEEP * (1 + 0.5 * np.abs(np.gradient(SWEEP, 1 / RATE)))
    records = []
    for k in (0.0, 250e3):
        y = Structure(()).simulate(THETA, Record(rated, rated, 1 / RATE, stiffness=k))
        y = y + 1e-5 * rng.standard_normal(len(T))
        records.append(Record(SWEEP, y, 1 / RATE, stiffness=k))
    return records


@pytest.mark.slow
@pytest.mark.parametrize('size', [1.03, 1.05])
def test_a_gain_of_one_test_is_named_with_its_record(size: float) -> None:
    """The spring test alone has a command gain: no common size explains it, its own does."""
    free, spring, _ = make(['gain'], [1.0], 23)
    wrong = Structure(()).simulate(
        THETA, Record(size * SWEEP, SWEEP, 1 / RATE, stiffness=250e3)
    ) + (spring.measured - Structure(()).simulate(THETA, spring))
    spring = replace(spring, measured=wrong, source='spring')
    found = diagnose([free, spring], settings=QUICK)
    assert found.verdict == 'missing-effect'
    assert [(e.name, e.records) for e in found.effects] == [('gain', ('spring',))]
    estimate = found.effects[0].parameters['gain']
    assert estimate.lower < size < estimate.upper
    assert found.error.after == pytest.approx(1e-5, rel=0.1)
    assert 'gain in spring only' in found.summary()


@pytest.mark.parametrize(
    ('effect', 'size'),
    [
        pytest.param('specimen-gap', 6e-4, marks=pytest.mark.slow),
        pytest.param('specimen-hardening', 2.5e5, marks=pytest.mark.slow),
        pytest.param('viscous-damping', 2e4, marks=pytest.mark.slow),
    ],
)
def test_a_specimen_effect_is_not_taken_for_a_setting(effect: str, size: float) -> None:
    """What only the specimen test shows is the specimen's where that explains it."""
    a, b, held = make([effect], [size], 24)
    found = diagnose([a, b], held, settings=QUICK)
    assert [(e.name, e.records) for e in found.effects] == [(effect, ())]


@pytest.mark.slow
def test_a_command_that_ran_linearly_is_seen() -> None:
    """Half a sample of lead, 4 ms here, looks like a drifting gain: the hold is said instead."""
    rng = np.random.default_rng(26)
    records = []
    for k in (0.0, 250e3):
        record = Record(SWEEP, SWEEP, 1 / RATE, stiffness=k, hold='linear')
        y = Structure(()).simulate(THETA, record) + 1e-5 * rng.standard_normal(len(T))
        records.append(replace(record, measured=y, hold='zoh'))
    found = diagnose(records, settings=QUICK)
    assert found.verdict == 'none'
    assert found.error.after == pytest.approx(1e-5, rel=0.1)
    assert found.setup is not None and found.setup.taken and found.setup.changed == ('hold',)


@pytest.mark.slow
def test_a_command_that_ran_linearly_is_seen_beside_an_effect() -> None:
    """Under the wrong hold play was friction, since a moment, beside a gain that drifts."""
    command = sweep(128.0, 40.0, 0.2, 10.0)
    command *= 2e-3 / np.abs(command).max()
    record = Record(command, command, 1 / 128.0, stiffness=250e3, hold='linear', source='a')
    theta = np.array([134.0, 1.1e9, 2.5e5, 0.5, 6e-5])
    clean = Structure(('backlash',)).simulate(theta, record).reshape(-1)
    noise = 5e-6 * np.random.default_rng(3).standard_normal(len(clean))
    found = diagnose([replace(record, measured=clean + noise, hold='zoh')], settings=QUICK)
    assert found.verdict == 'missing-effect' and found.structure == ('backlash',)
    first = found.structures[0]
    assert first.chosen and first.scope == 'command linear between samples'
    assert {row.scope for row in found.structures} == {'', first.scope}


def test_unknown_stiffness_is_refused() -> None:
    """The stiffness decides what is identified."""
    record = Record(SWEEP, SWEEP, 1 / RATE)
    with pytest.raises(InputError, match='stiffness'):
        diagnose([record])


@pytest.mark.slow
def test_the_same_seed_gives_the_same_diagnosis() -> None:
    """Bit for bit, with one thread or two, posterior included."""
    a, b, held = make(['delay'], [8e-3], 13)
    settings = Thresholds(evaluations=3000)
    one = diagnose([a, b], held, seed=4, settings=settings).to_json()
    with ThreadPoolExecutor(2) as pool:
        two = diagnose([a, b], held, seed=4, each=pool.map, settings=settings).to_json()
    assert one == two


@pytest.mark.slow
def test_what_the_catalogue_lacks_is_unexplained() -> None:
    """A reading whose gain wobbles, out of step from record to record, has no name."""
    rng, wobbling = np.random.default_rng(15), []
    for record in make([], [], 14):
        gain = 1.0 + 0.03 * np.sin(0.6 * np.pi * record.time + rng.uniform(0.0, 6.0))
        wobbling.append(replace(record, measured=gain * record.measured))
    found = diagnose(wobbling[:2], wobbling[2], settings=QUICK)
    assert found.verdict == 'unexplained'
    assert found.effects == ()
    assert found.remaining['left'] > found.remaining['limit']
    assert any('remain' in line for line in found.advice)
