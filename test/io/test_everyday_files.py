"""Files as laboratories have them, each written with the library of its makers."""

import datetime
import subprocess
import sys
import zipfile
from pathlib import Path

import h5py
import numpy as np
import openpyxl
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from nptdms import ChannelObject, RootObject, TdmsWriter
from scipy.io import savemat

from actuator_glue.errors import InputError
from actuator_glue.io import formats
from actuator_glue.io.channel_map import parse_channel_map
from actuator_glue.io.export import write
from actuator_glue.io.laboratory import read
from actuator_glue.records import Record

COUNT = 400
TIME = np.arange(COUNT) * 1e-3
COMMAND = np.sin(20 * TIME)  # mm
MEASURED = np.cos(20 * TIME)  # mm
FORCE = 3.0 * COMMAND  # kN
NAMES = ('time_s', 'command_mm', 'measured_mm', 'force_kN')
MATRIX = np.column_stack([TIME, COMMAND, MEASURED, FORCE])
UNITS = {'time': 's', 'command': 'mm', 'measured': 'mm', 'force': 'kN'}


def check(record: Record, *, force: bool = True) -> None:
    """Compare with what was written."""
    np.testing.assert_allclose(record.command, COMMAND * 1e-3, rtol=1e-12, atol=1e-18)
    np.testing.assert_allclose(record.measured, MEASURED * 1e-3, rtol=1e-12, atol=1e-18)
    assert record.period == 1e-3
    if force:
        assert record.force is not None
        np.testing.assert_allclose(record.force, FORCE * 1e3, rtol=1e-12, atol=1e-12)


def mapped(names: tuple[str | int, ...]):
    """Return a channel map that calls time, command, measured and force by these names."""
    channels = zip(UNITS.items(), names, strict=True)
    return parse_channel_map({r: {'column': n, 'unit': u} for (r, u), n in channels}, 'map')


def matlab_7_3(path: Path, content: dict[str, np.ndarray], classes: dict[str, str]) -> Path:
    """Write an HDF5 file as MATLAB writes version 7.3: turned matrices, 512 bytes of text."""
    with h5py.File(path, 'w', userblock_size=512) as file:
        for name, values in content.items():
            file[name] = np.atleast_2d(values)
            file[name].attrs['MATLAB_class'] = np.bytes_(classes.get(name, 'double'))
        for group in {name.partition('/')[0] for name in content if '/' in name}:
            file[group].attrs['MATLAB_class'] = np.bytes_('struct')
    with path.open('r+b') as file:
        file.write(b'MATLAB 7.3 MAT-file, Platform: GLNXA64'.ljust(124) + b'\x00\x02IM')
    return path


def test_matlab_7_3(tmp_path: Path) -> None:
    """Vectors, fields of a struct, text, and columns of a matrix."""
    content = {f'test/{name}': column for name, column in zip(NAMES, MATRIX.T, strict=True)}
    content['hold'] = np.array([ord(c) for c in 'linear'], dtype=np.uint16)
    path = matlab_7_3(tmp_path / 'a.mat', content, {'hold': 'char'})
    record = read(path)
    check(record)
    assert record.hold == 'linear'
    check(read(path, channels=mapped(tuple(f'test.{name}' for name in NAMES))))
    # In the file a matrix of 400 x 4 has 4 rows.
    path = matlab_7_3(tmp_path / 'b.mat', {'data': MATRIX.T}, {})
    check(read(path, channels=mapped(tuple(f'data(:,{i})' for i in (1, 2, 3, 4)))))


def test_columns_of_a_matrix_in_a_mat_file(tmp_path: Path) -> None:
    """By MATLAB's own names, standing or lying, in a struct or not; and by number."""
    savemat(tmp_path / 'a.mat', {'data': MATRIX, 'lying': {'x': MATRIX.T}})
    check(read(tmp_path / 'a.mat', channels=mapped(tuple(f'data(:,{i})' for i in (1, 2, 3, 4)))))
    lying = mapped(tuple(f'lying.x({i},:)' for i in (1, 2, 3, 4)))
    check(read(tmp_path / 'a.mat', channels=lying))
    check(read(tmp_path / 'a.mat', channels=mapped((1, 2, 3, 4))))
    with pytest.raises(InputError, match=r'8 columns.*number 9'):
        read(tmp_path / 'a.mat', channels=mapped((1, 2, 3, 9)))


def test_objects_of_matlab_are_named(tmp_path: Path) -> None:
    """A table or timeseries opens nowhere else; what to save instead is told."""
    savemat(tmp_path / 'a.mat', {'name': 'nothing but text'})
    path = matlab_7_3(tmp_path / 'b.mat', {'x': np.arange(6, dtype='u4')}, {'x': 'timeseries'})
    with h5py.File(path, 'r+') as file:
        file['x'].attrs['MATLAB_object_decode'] = np.int32(3)
    for name in ('a.mat', 'b.mat'):
        with pytest.raises(InputError, match='timeseries'):
            read(tmp_path / name)


def test_hdf5(tmp_path: Path) -> None:
    """Datasets in groups with units as attributes, a table of fields, an array of columns."""
    path = tmp_path / 'a.h5'
    with h5py.File(path, 'w') as file:
        for name, column in zip(UNITS, MATRIX.T, strict=True):
            file.create_dataset(f'run 1/{name}', data=column, compression='gzip')
            file[f'run 1/{name}'].attrs['units'] = UNITS[name]
        file.attrs['stiffness_N_per_m'] = 250e3
        table = np.rec.fromarrays(MATRIX.T, names='a,b,c,d')
        file['table'], file['array'] = table, MATRIX
    record = read(path)
    check(record)
    assert record.stiffness == 250e3
    check(read(path, channels=mapped(('table.a', 'table.b', 'table.c', 'table.d'))))
    check(read(path, channels=mapped(tuple(f'array(:,{i})' for i in (1, 2, 3, 4)))))
    path.rename(tmp_path / 'a.dat')  # known by its first bytes
    check(read(tmp_path / 'a.dat'))


def test_hdf5_cannot_hold_more_than_its_bytes(tmp_path: Path) -> None:
    """A few kilobytes that say they have a gigabyte take no memory."""
    with h5py.File(tmp_path / 'a.h5', 'w') as file:
        for name in ('time_s', 'command_mm', 'measured_mm'):
            file.create_dataset(name, shape=(10**8,), dtype='f8', chunks=(1000,))
    with pytest.raises(InputError, match='says that it has 800 MB'):
        read(tmp_path / 'a.h5')


def test_hdf5_does_not_leave_its_file(tmp_path: Path) -> None:
    """Links to other files, external storage and virtual datasets are passed over."""
    with h5py.File(tmp_path / 'secret.h5', 'w') as file:
        file['command_mm'] = COMMAND
    (tmp_path / 'raw').write_bytes(COMMAND.tobytes())
    layout = h5py.VirtualLayout(shape=(COUNT,), dtype='f8')
    layout[:] = h5py.VirtualSource(str(tmp_path / 'secret.h5'), 'command_mm', shape=(COUNT,))
    with h5py.File(tmp_path / 'a.h5', 'w') as file:
        file['time_s'], file['measured_mm'] = TIME, MEASURED
        file['command_mm'] = h5py.ExternalLink('secret.h5', 'command_mm')
        file.create_virtual_dataset('virtual/command_mm', layout)
        outside = [(str(tmp_path / 'raw'), 0, h5py.h5f.UNLIMITED)]
        file.create_dataset('raw/command_mm', (COUNT,), 'f8', external=outside)
    with pytest.raises(InputError, match='no column for command'):
        read(tmp_path / 'a.h5')


def test_a_damaged_tdms_file_is_one_line(tmp_path: Path) -> None:
    """Its library would warn of a segment that is cut off, and print all bytes of a bad text."""
    path = tmp_path / 'a.tdms'
    with TdmsWriter(path) as writer:
        writer.write_segment([ChannelObject('run', 'time_s', np.arange(300.0))])
    whole = path.read_bytes()
    bad_text = whole.replace(b"/'run'", b"/'ru\xff'")
    command = [sys.executable, '-m', 'actuator_glue.cli.main', 'info', str(path)]
    for content in (whole + whole[:40], bad_text + bad_text[:40], whole[:40]):
        path.write_bytes(content)
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert done.stderr.count('\n') == (done.returncode == 2), done.stderr


def test_tdms(tmp_path: Path) -> None:
    """Many segments of a value each, units in the properties, a waveform without times."""
    path = tmp_path / 'a.tdms'
    with TdmsWriter(path) as writer:
        for at in (slice(0, 1), slice(1, 2), slice(2, 300), slice(300, COUNT)):
            writer.write_segment(
                [
                    RootObject({'stiffness_N_per_m': 250e3}),
                    *(
                        ChannelObject('run', name, column[at], {'unit_string': unit})
                        for (name, unit), column in zip(UNITS.items(), MATRIX.T, strict=True)
                    ),
                ]
            )
    record = read(path)
    check(record)
    assert record.stiffness == 250e3
    check(read(path, channels=mapped(tuple(f'run/{name}' for name in UNITS))))
    waveform = {'wf_increment': 1e-3, 'wf_start_offset': 0.0}
    with TdmsWriter(tmp_path / 'b.tdms') as writer:
        writer.write_segment(
            [
                ChannelObject('run', 'command_mm', COMMAND, waveform),
                ChannelObject('run', 'measured_mm', MEASURED, waveform),
            ]
        )
    check(read(tmp_path / 'b.tdms'), force=False)


def test_parquet(tmp_path: Path) -> None:
    """Columns with units in their metadata; time stamps are seconds; single precision."""
    fields = [pa.field(n, pa.float64(), metadata={'unit': u}) for n, u in UNITS.items()]
    table = pa.table([pa.array(c) for c in MATRIX.T], schema=pa.schema(fields))
    pq.write_table(table, tmp_path / 'a.parquet', row_group_size=100)
    check(read(tmp_path / 'a.parquet'))
    start = np.datetime64('2026-05-01T12:00:00', 'ns')
    stamps = start + (np.arange(COUNT) * 1_000_000).astype('timedelta64[ns]')
    named = {'time': stamps, 'command_mm': COMMAND, 'measured_mm': MEASURED, 'note': ['x'] * COUNT}
    pq.write_table(pa.table(named), tmp_path / 'b.parquet')
    record = read(tmp_path / 'b.parquet')
    check(record, force=False)
    assert record.start_ns == pytest.approx(start.astype(int), abs=500)


@pytest.mark.parametrize('units', [False, True])
def test_excel(tmp_path: Path, units: bool) -> None:
    """The first sheet with numbers, title lines above, names with a line of units or without."""
    book = openpyxl.Workbook()
    book.active.append(['Exported by a data logger', None])
    sheet = book.create_sheet('data')
    sheet.append(['Test 7', datetime.date(2026, 5, 1)])
    sheet.append([])
    sheet.append([n.capitalize() for n in UNITS] if units else list(NAMES))
    if units:
        sheet.append([f'[{u}]' for u in UNITS.values()])
    for row in MATRIX.tolist():
        sheet.append(row)
    book.save(tmp_path / 'a.xlsx')
    check(read(tmp_path / 'a.xlsx'))
    check(read(tmp_path / 'a.xlsx', channels=mapped((1, 2, 3, 4))))
    record = read(tmp_path / 'a.xlsx')
    with pytest.raises(InputError, match='only read'):
        write(tmp_path / 'b.xlsx', record)


@pytest.mark.parametrize('form', ['{}', '[{}]', '({})'])
@pytest.mark.parametrize('coding', ['utf-8', 'cp1252', 'utf-16'])
def test_a_line_of_units_below_the_names(tmp_path: Path, form: str, coding: str) -> None:
    """As LabVIEW, DIAdem and dSPACE write it; µ and umlauts as Windows codes them."""
    units = ('s', 'µm', 'mm', 'kN', 'V')
    lines = ['Time,Command,Measured,Force,Prüfkraft', ','.join(map(form.format, units))]
    columns = (TIME, COMMAND * 1e3, MEASURED, FORCE, FORCE)
    lines += [','.join(map(repr, row)) for row in np.column_stack(columns).tolist()]
    path = tmp_path / 'a.csv'
    path.write_bytes('\r\n'.join(lines).encode(coding))
    check(read(path))
    check(
        read(
            path,
            channels=parse_channel_map(
                {
                    'command': {'column': 'Command', 'unit': 'um'},
                    'rate': 1000,
                    'measured': {'column': 'Measured', 'unit': 'mm'},
                    'force': {'column': 'Prüfkraft', 'unit': 'kN'},
                },
                'map',
            ),
        )
    )


def test_a_missing_library_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The message says which extra brings it."""
    files = {'h5py': '.h5', 'nptdms': '.tdms', 'pyarrow': '.parquet', 'openpyxl': '.xlsx'}
    for name, suffix in files.items():
        monkeypatch.setitem(sys.modules, name, None)
        path = tmp_path / f'a{suffix}'
        path.write_bytes(formats.formats()[suffix].begins + b'x')
        with pytest.raises(InputError, match=rf'{name} is needed.*actuator_glue\[lab\]'):
            read(path)


def test_sizes_are_checked_before_memory_is_taken(tmp_path: Path) -> None:
    """Files of a few kilobytes that unpack to more than a computer has."""
    with h5py.File(tmp_path / 'a.h5', 'w') as file:
        for name in NAMES:
            file.create_dataset(name, (1 << 40,), 'f8', chunks=(1 << 20,))
    with zipfile.ZipFile(tmp_path / 'a.xlsx', 'w', zipfile.ZIP_DEFLATED) as archive:
        archive.writestr('xl/sharedStrings.xml', bytes(70 << 20))
    for name, words in (('a.h5', 'GB of numbers'), ('a.xlsx', 'unpacks to 73 MB')):
        with pytest.raises(InputError, match=words):
            read(tmp_path / name)


def test_a_compressed_mat_file_is_measured_first(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A variable of zeros, a thousandth of its size in the file."""
    savemat(tmp_path / 'a.mat', {'x': np.zeros(1 << 20)}, do_compression=True)
    monkeypatch.setattr(formats, 'LARGEST', 4 << 20)
    with pytest.raises(InputError, match='GB of numbers'):
        read(tmp_path / 'a.mat')
