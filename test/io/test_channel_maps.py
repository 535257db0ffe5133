"""Channel maps: what they say of a file, and what is wrong with them."""

from pathlib import Path

import numpy as np
import pytest

from actuator_glue.errors import InputError
from actuator_glue.io.channel_map import parse_channel_map, read_channel_map
from actuator_glue.io.laboratory import read

MAP = {
    'command': {'column': 'u', 'unit': 'mm', 'scale': 10},
    'measured': {'column': 3, 'unit': 'mm', 'scale': -10, 'offset': 1.0},
    'rate': 100,
    'header_lines': 2,
}


def test_a_shipped_map_is_found_by_its_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Wherever a command is given."""
    own = read_channel_map(Path(__file__).resolve().parents[2] / 'config/channels/mts.yaml')
    monkeypatch.chdir(tmp_path)
    for name in 'mts.yaml', 'mts':
        assert read_channel_map(name).roles() == own.roles()
    with pytest.raises(InputError, match=r'No such file.*one of mts'):
        read_channel_map('mst.yaml')


@pytest.mark.parametrize('said', [{'decimal': ','}, {}], ids=['said', 'found'])
def test_a_map_reads_any_text(tmp_path: Path, said: dict[str, str]) -> None:
    """Column by name and number, scale, offset, header lines, decimal comma."""
    path = tmp_path / 'a.txt'
    path.write_text('made by nobody\nx;u;y\n' + ''.join(f'a;{i},5;{i},25\n' for i in range(20)))
    record = read(path, channels=parse_channel_map({**MAP, **said}, 'map'), hold='linear')
    i = np.arange(20)
    np.testing.assert_allclose(record.command, (i + 0.5) * 10e-3)
    np.testing.assert_allclose(record.measured, ((i + 0.25) * -10 + 1) * 1e-3, atol=1e-18)
    assert (record.period, record.hold) == (0.01, 'linear')


@pytest.mark.parametrize(
    ('change', 'words'),
    [
        ({'comand': {}}, 'did you mean command'),
        ({'measured': None}, 'measured is missing'),
        ({'measured': {'unit': 'mm'}}, 'column is missing'),
        ({'measured': {'column': 'y'}}, 'unit is missing'),
        ({'measured': {'column': 'y', 'unit': 'N'}}, "unit 'N'"),
        ({'measured': {'column': 0, 'unit': 'mm'}}, 'counted from 1'),
        ({'measured': {'column': 1.5, 'unit': 'mm'}}, 'name or a number'),
        ({'measured': {'column': 1, 'unit': 'mm', 'scale': 'x'}}, 'scale must be a number'),
        ({'measured': {'column': 1, 'unit': 'mm', 'remove_rest_offset': True}}, 'rest_samples'),
        ({'measured': {'column': 1, 'unit': 'mm', 'scale': 0}}, 'scale is 0; every value would'),
        ({'measured': 3}, 'must be a mapping'),
        ({'rate': None}, 'give `rate`'),
        ({'rate': -5}, 'outside'),
        ({'header_lines': -1}, 'at least 0'),
        ({'hold': 'cubic'}, 'use one of'),
        ({'stiffness': -1}, 'outside'),
        ({'delimiter': 5}, 'must be text'),
        ({'delimiter': ''}, 'map.yaml: channel map: delimiter is empty; leave it out'),
    ],
)
def test_maps_that_cannot_be_used(change: dict[str, object], words: str) -> None:
    """Unknown entry, missing entry, wrong kind, unit or range."""
    with pytest.raises(InputError, match=words):
        parse_channel_map({**MAP, **change}, 'map.yaml')


def test_map_files_that_cannot_be_used(tmp_path: Path) -> None:
    """Missing file, no YAML, no mapping; exponents without a point are numbers."""
    path = tmp_path / 'm.yaml'
    with pytest.raises(InputError, match='cannot be read'):
        read_channel_map(path)
    path.write_text('a: [b')
    with pytest.raises(InputError, match='not YAML'):
        read_channel_map(path)
    path.write_text('5')
    with pytest.raises(InputError, match='must be a mapping'):
        read_channel_map(path)
    path.write_text('rate: 1e3\ncommand: {column: 1, unit: m}\nmeasured: {column: 2, unit: m}\n')
    assert read_channel_map(path).rate == 1000.0


def test_a_wrong_column_and_a_moving_rest(tmp_path: Path) -> None:
    """A name that is not there lists those that are; a test at rest must be at rest."""
    path = tmp_path / 'a.txt'
    path.write_text('\nx,u,y\n' + ''.join(f'{i},{i},{i}\n' for i in range(50)))
    wrong = parse_channel_map({**MAP, 'command': {'column': 'v', 'unit': 'mm'}}, 'map')
    with pytest.raises(InputError, match=r"no column is called 'v'.*'x', 'u', 'y'"):
        read(path, channels=wrong)
    moving = {'column': 'u', 'unit': 'mm', 'remove_rest_offset': True}
    for samples, words in ((20, 'not at rest'), (50, '50 rest samples, but 50')):
        rest = parse_channel_map({**MAP, 'command': moving, 'rest_samples': samples}, 'map')
        with pytest.raises(InputError, match=words):
            read(path, channels=rest)
    push = {'column': 'u', 'unit': 'kN', 'remove_rest_offset': True}
    forced = parse_channel_map({**MAP, 'force': push, 'rest_samples': 20}, 'map')
    force = read(path, channels=forced).force
    assert force is not None
    assert force[1] == 1000.0
    far = parse_channel_map({**MAP, 'command': {'column': 9, 'unit': 'mm'}}, 'map')
    with pytest.raises(InputError, match='cannot read the samples'):
        read(path, channels=far)


@pytest.mark.parametrize(
    ('unit', 'scale', 'told'),
    [
        ('in', 1.0, "command: the channel map says 'in', and the file 'mm' of column 'Weg [mm]'"),
        ('mm', 1.0, ''),
        ('in', 0.5, ''),
    ],
)
def test_another_unit_than_the_file_gives_is_told(
    tmp_path: Path, unit: str, scale: float, told: str
) -> None:
    """The map counts, as it may mend a wrong name; with a scale it converts."""
    path = tmp_path / 'a.csv'
    path.write_text('Weg [mm],y\n' + ''.join(f'{i},{i}\n' for i in range(20)))
    content = {
        'command': {'column': 'Weg [mm]', 'unit': unit, 'scale': scale},
        'measured': {'column': 2, 'unit': 'mm'},
        'rate': 100,
    }
    said: list[str] = []
    record = read(path, channels=parse_channel_map(content, 'map'), warn=said.append)
    assert record.command[1] == pytest.approx(scale * {'in': 25.4e-3, 'mm': 1e-3}[unit])
    assert bool(said) == bool(told)
    assert all(told in line for line in said)


def told_in_mm(folder: Path, command: str, measured: str) -> list[str]:
    """Return what is told of columns with these names that a channel map has in mm."""
    path = folder / 'a.csv'
    path.write_text(f'{command},{measured}\n' + ''.join(f'{i},{i}\n' for i in range(20)))
    content = {
        'command': {'column': command, 'unit': 'mm'},
        'measured': {'column': 2, 'unit': 'mm'},
        'rate': 100,
    }
    said: list[str] = []
    read(path, channels=parse_channel_map(content, 'map'), warn=said.append)
    return said


def test_a_unit_of_no_length_is_not_proposed(tmp_path: Path) -> None:
    said = told_in_mm(tmp_path, 'Weg [V]', 'y [mm]')
    assert said[0].endswith('If the file is right, give mm per V as `scale`')


def test_letters_behind_a_name_contradict_no_map(tmp_path: Path) -> None:
    assert not told_in_mm(tmp_path, 'cmd_in', 'pos_m')
