"""`actuator-glue map`: what a channel is called decides what it cannot be, and doubts are told."""

import json
from pathlib import Path

import numpy as np
import pytest

from actuator_glue.cli.main import main

RATE, COUNT = 512.0, 2000
TIME = np.arange(COUNT) / RATE
RNG = np.random.default_rng(3)
COMMAND = np.convolve(RNG.standard_normal(COUNT + 99), np.ones(100) / 10.0, 'valid')
MEASURED = 0.97 * np.roll(COMMAND, 8) + 0.01 * RNG.standard_normal(COUNT)
FORCE = 3.0 * MEASURED + 0.1 * RNG.standard_normal(COUNT)


def looked(path: Path, columns: dict[str, np.ndarray]) -> dict:
    """Write columns beside a clock, run `map`, return its JSON."""
    rows = np.column_stack([TIME, *columns.values()])
    names = ','.join(['time_s', *columns])
    np.savetxt(path / 'a.csv', rows, fmt='%.6f', delimiter=',', header=names, comments='')
    main(['map', str(path / 'a.csv'), '--json', str(path / 'a.json'), '--force'])
    found: dict = json.loads((path / 'a.json').read_text())
    return found


def roles(found: dict) -> dict[str, str]:
    """Return the column of each role but time."""
    return {r: g['column'] for r, g in found['channels'].items() if r != 'time'}


COMMANDS = ['Command 2', 'cmd', 'Set Point', 'SetPoint', 'Target', 'x_desired', 'Ref']
COMMANDS += ['Reference', 'Sollwert', 'Demand pos', 'Commanded displacement', 'pos_sp', 'x_des']
COMMANDS += ['Führungsgröße', 'consigne', 'axis1.setpoint', 'cmd_fb', 'Wegsoll', 'PosDes']
COMMANDS += [
    'Consigna de posición',
    'riferimento',
    'Goal position',
    'wanted',
    '目标位移',
    '指令変位',
]
FORCES = [
    'Load [kN]',
    'force',
    'Kraft',
    'Actuator Load',
    'F [N]',
    'F',
    'Torque',
    'LC1',
    'kN',
    'Forza',
    '荷重',
]


@pytest.mark.parametrize('name', COMMANDS)
def test_what_is_called_a_command_is_never_measured(tmp_path: Path, name: str) -> None:
    """Not even where it follows another, and nothing else is there."""
    found = looked(tmp_path, {'A': COMMAND, name: MEASURED})
    assert roles(found).get('measured') != name
    found = looked(tmp_path, {name: MEASURED, 'Feedback': COMMAND})
    assert roles(found) == {'command': name, 'measured': 'Feedback'}
    assert any('leads the command by 15.6 ms' in w for w in found['channels']['measured']['check'])


@pytest.mark.parametrize('name', FORCES)
def test_a_force_is_never_a_displacement(tmp_path: Path, name: str) -> None:
    """It follows the command as the displacement does; without one nothing is measured."""
    found = looked(tmp_path, {'Command': COMMAND, name: FORCE})
    assert 'measured' not in roles(found)
    assert found['map'] is None
    found = looked(tmp_path, {'Command': COMMAND, name: FORCE, 'B': MEASURED})
    assert roles(found) == {'command': 'Command', 'measured': 'B', 'force': name}
    assert any('role' in words for words in found['channels']['measured']['check'])
    assert not any('role' in words for words in found['channels']['command']['check'])


@pytest.mark.parametrize(
    ('columns', 'told'),
    [
        ({'LVDT 1': MEASURED, 'LVDT 2': np.roll(MEASURED, 5)}, ''),
        ({'Valve command': COMMAND, 'LVDT': MEASURED}, "'Valve command' commands something else"),
        ({'Force cmd': COMMAND, 'Actual [mm]': MEASURED}, "'Force cmd' commands something else"),
        ({'cmd [mm/s]': COMMAND, 'Actual': MEASURED}, "'cmd [mm/s]' commands something else"),
        ({'Position': MEASURED, 'Pressure': COMMAND, 'Error': COMMAND - MEASURED}, ''),
    ],
)
def test_no_command_in_this_file_is_an_answer(
    tmp_path: Path, columns: dict[str, np.ndarray], told: str
) -> None:
    """Two sensors, a command of something else: no map, and what is needed."""
    found = looked(tmp_path, columns)
    assert 'command' not in found['channels']
    assert found['map'] is None
    assert 'no command in this file' in found['problem']
    assert told in found['problem']


def test_alternatives_are_listed(tmp_path: Path) -> None:
    """Of two that are called so the one that is followed is taken, and the other told."""
    spare = RNG.standard_normal(COUNT)
    columns = {'cmd raw': COMMAND, 'cmd spare': spare, 'pos 1': MEASURED, 'pos 2': spare}
    found = looked(tmp_path, columns)
    assert roles(found) == {'command': 'cmd raw', 'measured': 'pos 1'}
    assert any('cmd spare may be it' in words for words in found['channels']['command']['check'])


def test_channels_that_are_not_alike_are_doubted(tmp_path: Path) -> None:
    """Names say which they are; what they do speaks against it."""
    noise = RNG.standard_normal(COUNT)
    found = looked(tmp_path, {'Command': COMMAND, 'Actual': noise})
    assert roles(found) == {'command': 'Command', 'measured': 'Actual'}
    doubts = found['channels']['measured']['check']
    assert any('not like the command' in words for words in doubts)
