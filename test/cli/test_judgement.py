"""calibrate: what forbids the use of a posterior is the first line, in JSON and the exit code."""

import json
from pathlib import Path

import numpy as np
import pytest

from actuator_glue.model.structure import Structure
from actuator_glue.records import Record

RATE = 200.0
T = np.arange(int(20 * RATE)) / RATE
SWEEP = 2e-3 * np.sin(np.pi * (10.0 / 20.0) * T**2)
THETA = np.array([134.0, 1.1e9, 2.5e5, 0.5])


def write(
    path: Path, stiffness: float, theta: np.ndarray = THETA, *, offset: float = 0.0, seed: int = 1
) -> Path:
    """Write a test of an actuator with 5 um of noise."""
    y = Structure(()).simulate(theta, Record(SWEEP, SWEEP, 1 / RATE, stiffness=stiffness))
    y = y + offset + 5e-6 * np.random.default_rng(seed).standard_normal(len(T))
    rows = np.column_stack([T, 1e3 * SWEEP, 1e3 * y])
    np.savetxt(path, rows, delimiter=',', header='time_s,command_mm,measured_mm', comments='')
    return path


@pytest.fixture(scope='module')
def tests(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A free test and one with 250 kN/m."""
    folder = tmp_path_factory.mktemp('judged')
    return write(folder / 'free.csv', 0.0), write(folder / 'clamped.csv', 250e3, seed=2)


OPTIONS = ('--evaluations', 12_000)


def test_a_posterior_pressed_against_its_bound_is_told_first(run, tmp_path: Path) -> None:
    """beta_1 is 600 1/s and Table 3 ends at 400; wider bounds find it, and nothing is told."""
    fast = np.array([600.0, 1.1e9, 2.5e5, 0.5])
    files = [write(tmp_path / f'{k:g}.csv', k, fast, seed=3 + i) for i, k in enumerate((0, 250e3))]
    options = (*files, '--stiffness', 0, 250e3, *OPTIONS)
    done = run('calibrate', *options, '--json', tmp_path / 'c.json')
    assert done.code == 1, done.err
    assert done.out.splitlines()[0].startswith('beta_1 is pressed against the upper bound 400 1/s')
    assert '--bounds beta_1=LO:HI' in done.out.splitlines()[0]
    content = json.loads((tmp_path / 'c.json').read_text())
    (found,) = [p for p in content['at_bound'] if not p['physical']]
    assert (found['name'], found['bound'], found['value']) == ('beta_1', 'upper', 400.0)
    assert content['problems'] == [done.out.splitlines()[0]]
    wide = run('calibrate', *options, '--bounds', 'beta_1=0:2000', '--json', '-')
    assert wide.code == 0, wide.err
    found = wide.json['parameters']['beta_1']
    assert abs(found['mean'] - 600.0) < 5 * found['stddev']
    assert found['bounds'] == [0.0, 2000.0]
    assert not wide.json['problems']


def test_zero_leakage_is_no_reason_to_widen(run, problem_r: Path) -> None:
    """alpha_3 piles up at 0, where it may: told as such, and the posterior stands."""
    done = run('calibrate', problem_r / 'r_1.csv', problem_r / 'r_2.csv', *OPTIONS, '--json', '-')
    assert done.code == 1, 'problem R holds a gain that Eq. (2) cannot have'
    assert [p.split(':')[1] for p in done.json['problems']] == [
        ' intervals do not hold; run `actuator-glue diagnose` on the same records'
    ]
    found = {p['name']: p for p in done.json['at_bound']}
    assert found['alpha_3']['physical'] is True
    assert 'alpha_3 lies at 0' in done.err
    assert '--bounds' not in done.err


@pytest.mark.parametrize('bounds', ['beta_1', 'beta_1=1', 'beta_1=a:b', 'beta_1=9:1', 'x=0:1'])
def test_bounds_that_are_none_are_refused(run, tests: tuple[Path, Path], bounds: str) -> None:
    """One message that names them."""
    done = run('calibrate', tests[0], '--stiffness', 0, '--bounds', bounds)
    assert done.code == 2
    assert bounds.split('=')[0] in done.message


def test_a_parameter_that_cannot_be_negative_stays_so(run, tests: tuple[Path, Path]) -> None:
    """A negative leakage is no model."""
    done = run('calibrate', tests[0], '--stiffness', 0, '--bounds', 'alpha_3=-1:1')
    assert 'cannot be negative' in done.message


def test_stiffnesses_in_the_wrong_order_are_told_first(run, tests: tuple[Path, Path]) -> None:
    """The first line says which order explains them, and the exit code is 1."""
    done = run('calibrate', *tests, '--stiffness', 250e3, 0, *OPTIONS, '--json', '-')
    assert done.code == 1
    first = done.err.splitlines()[0]
    assert 'specimen stiffnesses exchanged (0 N/m for free.csv, 250000 N/m for clamped' in first
    assert 'intervals do not hold' in first
    assert done.json['structure']['setup']['stiffness'] == [0.0, 250e3]
    assert any(p.startswith('the model does not fit') for p in done.json['problems'])
    assert max(r['nrmse'] for r in done.json['error']['records']) > 0.1
    assert first in done.json['problems']


def test_an_offset_is_told_as_part_of_the_error(run, tmp_path: Path) -> None:
    """0.3 mm between the zeros of the channels; the record starts at rest all the same."""
    off = write(tmp_path / 'off.csv', 250e3, offset=3e-4)
    done = run('calibrate', off, '--stiffness', 250e3, *OPTIONS, '--json', '-')
    assert done.code == 1
    assert 'a constant offset of 0.3 mm' in done.json['problems'][0]
    assert done.json['initial'] == 'rest'


def test_calibrate_refuses_what_diagnose_refuses(run, tmp_path: Path) -> None:
    """Swapped channels, a reversed sign, one record twice: the same message from both."""
    rows = np.loadtxt(write(tmp_path / 'r.csv', 0.0), delimiter=',', skiprows=1)
    for name, columns, words in (
        ('swapped', rows[:, [0, 2, 1]], 'leads the command'),
        ('reversed', rows * [1.0, 1.0, -1.0], 'moves against the command'),
    ):
        path = tmp_path / f'{name}.csv'
        head = 'time_s,command_mm,measured_mm'
        np.savetxt(path, columns, delimiter=',', header=head, comments='')
        told = [run(c, path, '--stiffness', 0) for c in ('calibrate', 'diagnose')]
        assert [d.code for d in told] == [2, 2]
        assert told[0].message == told[1].message
        assert words in told[0].message
    twice = (tmp_path / 'r.csv', tmp_path / 'r.csv', '--stiffness', 0)
    assert 'would count twice' in run('calibrate', *twice).message
    held = (tmp_path / 'r.csv', '--holdout', tmp_path / 'r.csv', '--stiffness', 0)
    assert 'would judge itself' in run('diagnose', *held).message
