"""Gains and offsets that stand beside numbers: those of a convention count, others are told."""

from collections.abc import Callable, Mapping
from pathlib import Path

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from nptdms import ChannelObject, TdmsWriter

from actuator_glue.errors import InputError
from actuator_glue.io.channel_map import parse_channel_map
from actuator_glue.io.laboratory import read

TIME = np.arange(1000) * 1e-3
COLUMNS = {'time_s': TIME, 'command_mm': np.sin(30 * TIME), 'measured_mm': np.sin(30 * TIME - 0.1)}
Said = Mapping[str, object]
Writer = Callable[[Path, Said], Path]


def hdf5(folder: Path, said: Said) -> Path:
    """Write datasets, with attributes of the measured one."""
    path = folder / 'a.h5'
    with h5py.File(path, 'w') as file:
        for name, values in COLUMNS.items():
            file[name] = values
        file['measured_mm'].attrs.update(said)
    return path


def tdms(folder: Path, said: Said) -> Path:
    """Write channels, with properties of the measured one."""
    path = folder / 'a.tdms'
    channels = [
        ChannelObject('g', name, values, properties=dict(said) if name == 'measured_mm' else {})
        for name, values in COLUMNS.items()
    ]
    with TdmsWriter(str(path)) as file:
        file.write_segment(channels)
    return path


def parquet(folder: Path, said: Said) -> Path:
    """Write columns, with metadata of the measured one."""
    path = folder / 'a.parquet'
    own = {name: str(value) for name, value in said.items()}
    fields = [
        pa.field(name, pa.float64(), metadata=own if name == 'measured_mm' else None)
        for name in COLUMNS
    ]
    pq.write_table(pa.table(list(COLUMNS.values()), schema=pa.schema(fields)), path)
    return path


WRITERS = pytest.mark.parametrize('write', [hdf5, tdms, parquet])


@WRITERS
@pytest.mark.parametrize(
    'name', ['gain', 'Scale', 'calibration_factor', 'Calibration Factor', 'offset', 'slope']
)
def test_what_nobody_applies_is_told(tmp_path: Path, write: Writer, name: str) -> None:
    """Whether the numbers have it already nobody knows, so it is told, once, and left."""
    told: list[str] = []
    record = read(write(tmp_path, {name: 2.5}), warn=told.append)
    assert np.allclose(record.measured, 1e-3 * COLUMNS['measured_mm'])
    (line,) = told
    assert f'measured_mm has {name} = 2.5: this is not applied' in line
    assert '`scale` or `offset` in a channel map' in line


@WRITERS
@pytest.mark.parametrize(
    'said',
    [
        {'gain': 1.0, 'offset': 0.0},
        {'sensitivity': 12.5, 'range': 20.0, 'serial': 7},
        {'scale': 'linear', 'gain_mode': 3.0, 'offset_nulling': 1.0, 'calibration': 2024},
    ],
)
def test_what_changes_nothing_is_not_told(tmp_path: Path, write: Writer, said: Said) -> None:
    """Gains of one, and words of other meanings."""
    told: list[str] = []
    read(write(tmp_path, said), warn=told.append)
    assert not told


@WRITERS
def test_who_gives_a_scale_knows(tmp_path: Path, write: Writer) -> None:
    """A channel map with the factor is the answer that the note asks for."""
    told: list[str] = []
    path = write(tmp_path, {'gain': 2.5})
    place = 'g/' if path.suffix == '.tdms' else ''
    channels = {
        'time': {'column': f'{place}time_s', 'unit': 's'},
        'command': {'column': f'{place}command_mm', 'unit': 'mm'},
        'measured': {'column': f'{place}measured_mm', 'unit': 'mm', 'scale': 2.5},
    }
    record = read(path, channels=parse_channel_map(channels, 'a map'), warn=told.append)
    assert not told
    assert np.allclose(record.measured, 2.5e-3 * COLUMNS['measured_mm'])


def test_a_convention_is_no_doubt(tmp_path: Path) -> None:
    """That of netCDF is applied."""
    told: list[str] = []
    record = read(hdf5(tmp_path, {'scale_factor': 2.5}), warn=told.append)
    assert not told
    assert np.allclose(record.measured, 2.5e-3 * COLUMNS['measured_mm'])


@WRITERS
@pytest.mark.parametrize('name', ['unit', 'units', 'Unit', 'Units', 'unit_string'])
def test_a_unit_is_read_whatever_its_attribute_is_called(
    tmp_path: Path, write: Writer, name: str
) -> None:
    """Each format knew its own name of it, and passed over the others."""
    with pytest.raises(InputError, match="'mm' in its name, and the file gives 'V' as its unit"):
        read(write(tmp_path, {name: 'V'}))
    for same in ('mm', 'none', ''):
        record = read(write(tmp_path, {name: same}))
        assert np.allclose(record.measured, 1e-3 * COLUMNS['measured_mm'])


@pytest.mark.parametrize(
    'text', [np.array(['mm'], dtype=h5py.string_dtype()), np.array([b'mm']), np.bytes_('mm'), 'mm']
)
def test_an_attribute_may_be_an_array_of_one(tmp_path: Path, text: object) -> None:
    """As MATLAB and others write texts: it was taken with its brackets."""
    path = tmp_path / 'a.h5'
    with h5py.File(path, 'w') as file:
        file['time_s'] = TIME
        for name in ('command', 'measured'):
            file[name] = COLUMNS[f'{name}_mm']
            file[name].attrs['units'] = text
        file.attrs['hold'] = np.array(['linear'], dtype=h5py.string_dtype())
        file.attrs['stiffness_N_per_m'] = np.array([250e3])
    record = read(path)
    assert np.allclose(record.measured, 1e-3 * COLUMNS['measured_mm'])
    assert (record.hold, record.stiffness) == ('linear', 250e3)


def test_an_attribute_without_a_value_says_nothing(tmp_path: Path) -> None:
    """As MATLAB writes a text of no letters: a hold of that name refused the file."""
    path = hdf5(tmp_path, {'units': h5py.Empty('S1'), 'gain': h5py.Empty('f')})
    with h5py.File(path, 'a') as file:
        file.attrs.update(hold=h5py.Empty('S1'), stiffness_N_per_m=h5py.Empty('f'))
    told: list[str] = []
    record = read(path, warn=told.append)
    assert (record.hold, record.stiffness, told) == ('zoh', None, [])
