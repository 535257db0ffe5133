"""Commands of velocity or of a valve: told as such, and no displacement command taken for one."""

import json
from pathlib import Path

import numpy as np
import pytest
import scipy.signal

import actuator_glue as ag
from actuator_glue.cli.main import main
from actuator_glue.errors import InputError
from actuator_glue.records import Record
from actuator_glue.velocity_command import is_velocity

RATE, COUNT = 500.0, 10_000
TIME = np.arange(COUNT) / RATE


def commands(seed: int) -> dict[str, np.ndarray]:
    """Return commands of the usual kinds, of size 1."""
    rng = np.random.default_rng(seed)
    low = scipy.signal.butter(4, [0.2, 8.0], 'bandpass', fs=RATE, output='sos')
    noise = scipy.signal.sosfilt(low, rng.standard_normal(COUNT))
    return {
        'sweep': np.sin(np.pi * 10.0 / 20.0 * TIME**2),
        'down': np.sin(np.pi * 10.0 / 20.0 * TIME**2)[::-1],
        'noise': noise / noise.std(),
        'earthquake': noise / noise.std() * np.exp(-(((TIME - 6.0) / 4.0) ** 2)),
        'steps': np.sign(np.sin(2.0 * np.pi * 0.3 * TIME)) * (TIME > 1.0),
        'sine': np.sin(2.0 * np.pi * 2.0 * TIME),
        'ramp': np.clip(TIME - 2.0, 0.0, 10.0),
    }


def follows(command: np.ndarray, corner: float) -> np.ndarray:
    """Return what a loop of this bandwidth [Hz] makes of a command."""
    return scipy.signal.lfilter(*scipy.signal.butter(1, corner, fs=RATE), command)


@pytest.mark.parametrize('kind', commands(0))
@pytest.mark.parametrize('corner', [0.7, 3.0, 20.0])
def test_no_displacement_command_is_taken_for_one(kind: str, corner: float) -> None:
    """However badly the loop follows, beside an offset and noise."""
    for seed in range(5):
        command = commands(seed)[kind]
        noise = 0.02 * np.random.default_rng(seed).standard_normal(COUNT)
        assert not is_velocity(command, follows(command, corner) + 3.0 + noise, RATE)


@pytest.mark.parametrize('kind', ['sweep', 'down', 'noise', 'earthquake', 'steps'])
@pytest.mark.parametrize('sign', [1.0, -7.0])
def test_a_command_of_velocity_is_told(kind: str, sign: float) -> None:
    """Late, of any unit and sign, with an offset that makes the piston drift."""
    for seed in range(5):
        command = commands(seed)[kind]
        moved = sign * np.cumsum(follows(command, 20.0) + 0.05) / RATE
        noise = 0.01 * moved.std() * np.random.default_rng(seed).standard_normal(COUNT)
        assert is_velocity(command + 0.3, moved + noise, RATE)


def test_calibrate_and_map_say_what_is_needed(tmp_path: Path) -> None:
    """One line of what it is and what to record; `map` names both columns."""
    command = commands(1)['noise']
    moved = np.cumsum(follows(command, 20.0)) / RATE
    record = Record(5e-3 * command, 5e-3 * moved, 1.0 / RATE, 0.0, source='a.csv')
    with pytest.raises(InputError, match=r'a\.csv: .*a displacement command is needed'):
        ag.calibrate([record])
    rows = np.column_stack([TIME, command, moved])
    for names in ('time_s,cmd,pos', 'time_s,Channel 1,Channel 2'):
        np.savetxt(tmp_path / 'a.csv', rows, delimiter=',', header=names, comments='')
        assert main(['map', str(tmp_path / 'a.csv'), '--json', str(tmp_path / 'a.json')]) == 1
        found = json.loads((tmp_path / 'a.json').read_text())
        assert found['map'] is None
        one, other = names.split(',')[1:]
        assert f'{other} follows the integral of {one}' in found['problem']
        assert 'displacement command is needed' in found['problem']
        (tmp_path / 'a.json').unlink()


def test_a_unit_of_velocity_says_so(tmp_path: Path) -> None:
    """A column called `command_mm/s` is no displacement command."""
    (tmp_path / 'a.csv').write_text('time_s,command_mm/s,measured_mm\n0,1,2\n0.01,2,3\n')
    with pytest.raises(InputError, match=r"'mm/s'.*a displacement command is needed"):
        ag.load(tmp_path / 'a.csv')
