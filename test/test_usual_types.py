"""Paths and numbers of every usual type are taken by every public function, or refused by name."""

import shutil
from collections.abc import Callable
from dataclasses import replace
from datetime import timedelta
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any, cast

import numpy as np
import pandas as pd
import pytest

import actuator_glue as ag
from actuator_glue.api.calibration_options import CalibrationOptions as _Calibration
from actuator_glue.api.diagnosis import DiagnosisOptions as _Diagnosis
from actuator_glue.api.given import records_given
from actuator_glue.cli.main import main
from actuator_glue.errors import InputError

# What numpy's numbers and paths of others are to a type checker is not what is asked here.
api: Any = ag
CalibrationOptions: Any = _Calibration
DiagnosisOptions: Any = _Diagnosis

# The same number in the types that numpy, pandas and people have.
SAME: tuple[Callable[[float], Any], ...] = (
    int,
    float,
    np.int64,
    np.int32,
    np.float32,
    np.float64,
    np.array,
    Fraction,
    Decimal,
)
NONE: tuple[Any, ...] = ('250e3', True, [250e3], np.array([1.0, 2.0]), {}, object(), 1j, np.nan)


class Named:
    """A path of somebody's own kind."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __fspath__(self) -> str:
        """Return the path."""
        return str(self.path)


@pytest.fixture(scope='module')
def record() -> ag.Record:
    """Six seconds at 100 Hz."""
    made: ag.Record = api.simulate(
        api.Command(rate=100, duration=6, high=5), stiffness=250000, seed=3
    )
    return made


@pytest.fixture(scope='module')
def file(record: ag.Record, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same as a file that says its stiffness."""
    from actuator_glue.io.export import write

    path = tmp_path_factory.mktemp('given') / 'test.csv'
    write(path, record, unit='m')
    return path


@pytest.fixture(scope='module')
def posterior(file: Path) -> ag.Calibration:
    """A calibration of the file by its name, with a fresh seed."""
    options = {'evaluations': np.float64(12e3), 'settle': np.float32(0)}
    found: ag.Calibration = api.calibrate(str(file), seed=None, **options)
    return found


def test_calibrate_takes_files_and_says_its_fresh_seed(
    posterior: ag.Calibration, file: Path, record: ag.Record
) -> None:
    """The seed that is said gives the same draws again, from the record and from its path."""
    assert isinstance(posterior.seed, int) and posterior.evaluations <= 12_000
    for given in ([file], record, (Named(file),), iter([str(file)])):
        again = api.calibrate(
            given, evaluations=12_000, seed=np.uint32(posterior.seed), stiffness=np.array(250e3)
        )
        np.testing.assert_array_equal(again.draws, posterior.draws)


def test_diagnose_takes_files(
    file: Path, record: ag.Record, posterior: ag.Calibration, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What is diagnosed is what the file holds, with a fresh seed."""
    seen: dict[str, Any] = {}

    def diagnosed(records: Any, held: Any, **options: Any) -> None:
        seen.update(options, records=records, held=held)
        raise InterruptedError

    monkeypatch.setattr('actuator_glue.api.diagnosis.core.diagnose', diagnosed)
    age = timedelta(hours=1)
    other = replace(posterior, sketches=())  # as if of another test
    with pytest.raises(InterruptedError):
        api.diagnose([str(file)], holdout=Named(file), seed=None, prior=other, prior_age=age)
    for (given,) in (seen['records'], seen['held']):
        np.testing.assert_array_equal(given.measured, record.measured)
    assert type(seen['seed']) is int and seen['before'].prior.age_s == 3600.0
    monkeypatch.undo()
    held = api.simulate(
        api.Command('noise', rate=100, duration=6, high=5), stiffness=250e3, seed=4
    )
    with pytest.raises(InputError, match='holds the same samples'):
        api.diagnose(record, holdout=file)
    with pytest.raises(InputError, match='holdout: int'):
        api.diagnose(record, holdout=[held, 3])


def test_replay_takes_files(file: Path) -> None:
    """As records of the same file."""
    options = {
        'window': np.int64(3),
        'hop': Fraction(3, 2),
        'evaluations': 6e3,
        'seed': np.int8(3),
    }
    a, b = api.replay(Named(file), **options), api.replay([file], **options)
    assert a.windows and a.windows[-1].parameters == b.windows[-1].parameters


def test_rths_takes_files(
    posterior: ag.Calibration, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A calibration by its file, fresh seeds, numbers of numpy's; so does the comparison."""
    path = posterior.save(str(tmp_path / 'p.npz'))
    a: ag.StabilityResult = api.rths(
        'benchmark_case_1', str(path), draws=np.int64(20), seed=None, frequencies=np.array([1])
    )
    b = api.rths('benchmark_case_1', posterior, draws=20.0, seed=a.seed, frequencies=np.float32(1))
    assert a.p_unstable == b.p_unstable and a.tracking == b.tracking
    assert a.to_json()['seed'] == a.seed and a.go(np.float32(1.0)) == b.go(1)
    seen: list[tuple[Any, int]] = []

    def one(partition: str, calibration: Any, *, seed: int, **options: Any) -> ag.StabilityResult:
        seen.append((calibration, seed))
        return a

    monkeypatch.setattr('actuator_glue.api.compensation.rths', one)
    api.compare_compensators('benchmark_case_1', path, seed=None)
    assert len({seed for _, seed in seen}) == 1 and type(seen[0][1]) is int
    np.testing.assert_array_equal(seen[0][0].draws, posterior.draws)
    space: Any = posterior.state_space
    assert np.isfinite(space(np.int64(250000), np.int64(3)).A).all()
    nothing: tuple[Any, ...] = (3, None, {})
    for wrong in nothing:
        with pytest.raises(InputError, match='is no calibration'):
            api.rths('benchmark_case_1', wrong)
    with pytest.raises(InputError, match=r'partition is \{\}'):
        api.rths({}, posterior)
    with pytest.raises(InputError, match='partition is 3'):
        posterior.report(tmp_path / 'p.html', partition=cast(Any, 3))
    for option in ('ground_motion', 'criteria'):
        with pytest.raises(InputError, match=f'{option} is 3'):
            api.rths('benchmark_case_1', posterior, **{option: 3})
    with pytest.raises(InputError, match=r'^monday.npz: there is no such file$'):
        api.rths('benchmark_case_1', 'monday.npz')
    response: Any = posterior.frequency_response
    with pytest.raises(InputError, match="frequencies is 'low'"):
        response(250e3, 'low')
    assert response(250e3, 2).frequency.tolist() == [2.0]


@pytest.mark.parametrize('kind', SAME)
def test_numbers_of_every_type_are_the_same(kind: Callable[[float], Any], file: Path) -> None:
    """In every public function and class that takes some."""
    k, usual = kind(250000), api.Command(rate=200, duration=3, amplitude=1, high=2)
    made = api.simulate(
        api.Command('sweep', kind(200), kind(3), kind(1), None, kind(2)), stiffness=k
    )
    same = api.simulate(usual, stiffness=250e3)
    np.testing.assert_array_equal(made.measured, same.measured)
    assert type(made.stiffness) is float and made.period == 1.0 / 200.0
    assert api.Record([0, 1, 2], [0, 1, 2], kind(1), k).rate == 1.0
    several: tuple[Any, ...] = (k, [k], (k,), np.array([k]))
    for given in several:
        assert api.load_records(file, stiffness=given)[0].stiffness == 250e3
        assert records_given(file, stiffness=given)[0].stiffness == 250e3
    assert api.load(Named(file), stiffness=k).stiffness == 250e3
    options = CalibrationOptions(
        evaluations=kind(60000),
        seed=kind(3),
        settle=kind(2),
        prior='monday.npz',
        drift=kind(1),
        prior_age=kind(60),
        bounds={'beta_1': (kind(0), kind(800))},
        shaping_factor=kind(256),
    )
    plain = CalibrationOptions(
        evaluations=60000,
        seed=3,
        settle=2,
        prior='monday.npz',
        drift=1,
        prior_age=60,
        bounds={'beta_1': (0, 800)},
        shaping_factor=256,
    )
    assert options == plain and type(options.evaluations) is int
    known = {'prior': 'monday.npz', 'drift': kind(1), 'prior_age': kind(60)}
    diagnosis = DiagnosisOptions(seed=kind(3), jobs=kind(2), **known)
    assert diagnosis == DiagnosisOptions(3, 2, prior='monday.npz', drift=1, prior_age=60)
    specimen = api.Specimen(kind(2), kind(3), k, {'mass': kind(1)})
    assert specimen == api.Specimen(2.0, 3.0, 250e3, {'mass': 1.0})
    assert type(specimen.stiffness) is float
    partition = api.Partition([[kind(2)]], [[kind(3)]], [[k]], specimen, kind(1000), kind(0))
    assert partition.rate == 1000.0 and partition.interface == 0


@pytest.mark.parametrize('wrong', NONE, ids=lambda wrong: type(wrong).__name__)
def test_what_is_no_number_is_refused_by_name(wrong: Any, file: Path) -> None:
    """One clear error that names the argument, whatever was given."""
    usual = api.Command(rate=200, duration=3)
    calls: dict[str, Callable[[], object]] = {
        'specimen stiffness': lambda: api.simulate(usual, stiffness=wrong),
        'duration': lambda: api.Command(duration=wrong),
        'sample period': lambda: api.Record([0, 1], [0, 1], wrong),
        'evaluations': lambda: CalibrationOptions(evaluations=wrong),
        'settle': lambda: CalibrationOptions(settle=wrong),
        'bound': lambda: CalibrationOptions(bounds={'beta_1': (0.0, wrong)}),
        'seed': lambda: CalibrationOptions(seed=wrong),
        'prior_age': lambda: DiagnosisOptions(prior_age=wrong),
        'jobs': lambda: DiagnosisOptions(jobs=wrong),
        'hop': lambda: api.replay(file, hop=wrong),
        'draws': lambda: api.rths('benchmark_case_1', 'none.npz', draws=wrong),
        'mass': lambda: api.Specimen(wrong, 1.0, 1.0),
    }
    for name, call in calls.items():
        with pytest.raises(InputError, match=name):
            call()


ODD = [object(), {'a': 1}, 'no', 1.5, -1.0, [1.0, 2.0], np.zeros((2, 2)), b'x', True]


@pytest.mark.parametrize('wrong', ODD, ids=lambda wrong: type(wrong).__name__)
def test_arguments_of_another_kind_are_refused(wrong: Any, file: Path) -> None:
    """Never with an error of Python's: the message begins with the argument."""
    usual = api.Command(rate=200, duration=3)
    record = api.simulate(usual)
    calls: dict[str, Callable[[], object]] = {
        'hold': lambda: api.load(file, hold=wrong),
        'command': lambda: api.simulate(wrong),
        'theta': lambda: api.simulate(usual, theta=wrong),
        'sensors': lambda: api.simulate(usual, sensors=wrong),
        'plant': lambda: api.simulate(usual, plant=wrong),
        'likelihood': lambda: CalibrationOptions(likelihood=wrong),
        'joining': lambda: api.join(file, file, by=wrong),
        'options': lambda: api.calibrate(record, wrong),
    }
    if not isinstance(wrong, str):
        calls |= {
            'channels': lambda: api.load(file, channels=wrong),
            'recipe': lambda: api.campaign(file, 'out', wrong),
            'effect': lambda: api.simulate(usual, effects=wrong),
        }
    if not isinstance(wrong, dict):
        calls |= {
            'records|no such': lambda: api.campaign(wrong, 'out'),
            'bounds': lambda: CalibrationOptions(bounds=wrong),
            'stddev': lambda: api.Specimen(1.0, 1.0, 1.0, wrong),
            'effects|catalogue': lambda: api.calibrate(record, effects=wrong),
        }
    if wrong is not ODD[3]:
        calls['resampl'] = lambda: api.load(file, resample=wrong)
    if wrong is not ODD[4]:
        calls['start'] = lambda: record.slice(wrong, 500)
    for name, call in calls.items():
        with pytest.raises(InputError, match=name):
            call()


@pytest.mark.parametrize('wrong', [3, None, {'a': 1}, [1.0], b'test.csv'], ids=repr)
def test_what_is_no_record_is_refused(wrong: Any) -> None:
    """A message says what may be given."""
    for call in (api.calibrate, api.diagnose, api.replay, api.load, api.load_records):
        with pytest.raises(InputError, match=r'is no|no such|cannot'):
            call(wrong)


def test_what_holds_more_than_paths_is_refused(file: Path) -> None:
    """Columns of a table, keys of a mapping, lines of an open file are not taken for paths."""
    table = pd.DataFrame({'time_s': [0.0, 0.1], 'command_mm': [0.0, 1.0]})
    with file.open() as opened:
        for wrong in (table, {str(file): 1}, opened):
            for call in (api.calibrate, api.load, api.load_records):
                with pytest.raises(InputError, match=f'{type(wrong).__name__} is no'):
                    call(wrong)


def test_a_second_record_is_not_taken_for_options(file: Path, record: ag.Record) -> None:
    """Several go into one list."""
    for other in (file, record, [record]):
        with pytest.raises(InputError, match=r'calibrate\(\[free, clamped\]\)$'):
            api.calibrate(record, other)


def test_the_home_folder_is_found(
    file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As shells do, which leave `--out=~/a.csv` and what Python says to the program."""
    monkeypatch.setenv('HOME', str(tmp_path))
    shutil.copy(file, tmp_path / 'test.csv')
    (tmp_path / 'map.yaml').write_text(
        'time: {column: time_s, unit: s}\n'
        'command: {column: command_m, unit: m}\nmeasured: {column: measured_m, unit: m}\n'
    )
    for path in ('~/test.csv', Path('~/test.csv')):
        (found,) = api.load_records([path], channels='~/map.yaml')
        assert found.source == str(tmp_path / 'test.csv')
    assert main(['convert', '~/test.csv', '~/out/test.csv']) == 0
    assert main(['info', '~/out/test.csv', '--json=~/info.json']) == 0
    assert (tmp_path / 'info.json').is_file()
    for name in ('~$test.csv', '~nobody/test.csv', 'a~.csv'):
        with pytest.raises(InputError, match=r'there is no such file'):
            api.load(name)


def test_an_unknown_stiffness_is_said_as_on_the_command_line(record: ag.Record) -> None:
    """It was called no number; what a record says is left aside."""
    with pytest.raises(InputError, match=r'is not known; .*`combinations` does in Python'):
        api.calibrate(record, stiffness='unknown')
    known = replace(record, stiffness=2e3)
    (given,) = records_given(known, cast('Any', 'unknown'))
    assert given.stiffness is None


def test_what_else_fails_is_refused_by_name(
    posterior: ag.Calibration, file: Path, record: ag.Record, tmp_path: Path
) -> None:
    """Errors of Python, numpy and pandas said nothing of the argument; some were passed over."""
    arrays, mat = api.Record.from_arrays, tmp_path / 'a.mat'
    time, moved = record.time, record.command
    calls: dict[str, Callable[[], Any]] = {
        'command must be one-dim': lambda: arrays(time, None, moved, unit='m'),
        'command is not a list': lambda: arrays(time, (v for v in moved), moved, unit='m'),
        'measured is not a list': lambda: arrays(time, moved, moved > 0.0, unit='m'),
        'command: NoneType': lambda: posterior.predict(cast('Any', None), 0.0),
        'command is a list': lambda: posterior.predict(cast('Any', [record]), 0.0),
        "stiffness is 'a'": lambda: posterior.save_mat(mat, cast('Any', [0.0, 'a'])),
        "stiffness is '0'": lambda: api.calibrate([record, record], stiffness=(0, '0')[::-1]),
        'partition is a Calib': lambda: api.rths(posterior, 'sdof'),
        'partition is a C': lambda: api.compare_compensators(posterior, 'sdof'),
        'resample': lambda: api.join(file, file, resample='a'),
        'no record given': lambda: api.campaign([], tmp_path / 'out'),
        'records': lambda: api.campaign(b'a.csv', tmp_path / 'out'),
        'effect is 3': lambda: api.effects.save_effects(tmp_path / 'a.yaml', [3]),
        'effects is None': lambda: api.effects.save_effects(tmp_path / 'a.yaml', None),
        'bytes is no path': lambda: api.load(b'a.csv'),
    }
    for name, call in calls.items():
        with pytest.raises(InputError, match=name):
            call()


def test_nothing_is_refused(file: Path) -> None:
    """No record at all."""
    for call in (api.calibrate, api.diagnose, api.replay, api.load_records):
        with pytest.raises(InputError, match='record'):
            call([])
    with pytest.raises(InputError, match='2 stiffnesses for 1 records'):
        api.calibrate(file, stiffness=[0, 1])


def test_effects_are_read_from_and_written_to_any_path(tmp_path: Path) -> None:
    """The module of effects takes what `open` takes."""
    parameter = api.effects.Parameter('bend', '1/m', np.int64(-50), np.float32(50), 'bend', 0)
    effect = api.effects.term('bent', 'sensor: y = y + bend*y**2', (parameter,))
    for path in (tmp_path / 'a.yaml', str(tmp_path / 'b.yaml'), Named(tmp_path / 'c.yaml')):
        api.effects.save_effects(path, [effect])
        (again,) = api.effects.read_effects(path)
        assert again.name == 'bent'


def test_what_is_no_effect_and_no_specimen_is_refused() -> None:
    """By name, before anything is asked of it."""
    effect: Any = 'bent'
    with pytest.raises(InputError, match="effect is 'bent'"):
        api.effects.register(effect)
    one, specimen = np.eye(1), effect
    with pytest.raises(InputError, match="specimen is 'bent'"):
        api.Partition(one, one, one, specimen, 1000.0)


@pytest.mark.parametrize('given', [[2e-4], 2e-4, 'large'])
def test_sizes_of_effects_are_given_by_parameter(given: Any) -> None:
    """Anything else is refused with the form that is meant."""
    with pytest.raises(api.InputError, match=r"effects=\{'backlash': \{PARAMETER: VALUE\}\}"):
        api.simulate(api.Command(rate=100.0, duration=2.0), effects={'backlash': given})
