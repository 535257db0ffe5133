"""Good files of every format that is read, and how they are used; fuzzers start from them."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import h5py
import numpy as np
import openpyxl
import pyarrow as pa
import pyarrow.parquet as pq
from nptdms import ChannelObject, TdmsWriter
from scipy.io import savemat
from scipy.sparse import csc_array

from actuator_glue.effects import read_effects
from actuator_glue.errors import InputError
from actuator_glue.io.bag_records import write_record
from actuator_glue.io.bag_writer import BagWriter
from actuator_glue.io.channel_map import parse_channel_map, read_channel_map
from actuator_glue.io.load import load_records
from actuator_glue.io.look import look
from actuator_glue.records import Record

COUNT = 300
RNG = np.random.default_rng(0)
COLUMNS = {
    'time_s': np.arange(COUNT) * 1e-3,
    'command_mm': RNG.standard_normal(COUNT),
    'measured_mm': RNG.standard_normal(COUNT),
}
MAP = """
rate: 1000
command: {column: 1, unit: mm, scale: 2}
measured: {column: measured_mm, unit: mm}
stiffness: 250e3
"""
EFFECTS = """
bent-sensor:
  sensor: y = y + bend*y**2
  parameters:
    bend: {unit: 1/m, bounds: [-50, 50], neutral: 0, meaning: even part}
"""
TOPICS = parse_channel_map(
    {r: {'column': f'/samples.{r}[0]', 'unit': 'mm'} for r in ('command', 'measured')}, 'map'
)


def csv(path: Path) -> None:
    """Write delimited text with a line of units."""
    rows = np.column_stack(list(COLUMNS.values())).tolist()
    lines = ['time,command,measured', 's,mm,mm', *(','.join(map(repr, row)) for row in rows)]
    path.write_text('\n'.join(lines))


def mat(path: Path) -> None:
    """Write a MATLAB file of version 7."""
    savemat(path, {'test': COLUMNS, 'matrix': np.zeros((40, 3))}, do_compression=True)


def mat_6(path: Path) -> None:
    """Write a MATLAB file of version 6, where no checksum finds damage, with every class."""
    cells = np.empty(3, object)
    cells[:] = ['text', np.arange(3.0), {'a': 1, 'b': 1j * np.arange(4)}]
    others = {'cells': cells, 'sparse': csc_array(np.eye(9)), 'logical': np.array([True, False])}
    savemat(path, {'test': COLUMNS, **others}, do_compression=False)


def hdf5(path: Path) -> None:
    """Write an HDF5 file with compression and attributes."""
    with h5py.File(path, 'w') as file:
        for name, values in COLUMNS.items():
            file.create_dataset(f'run/{name}', data=values, compression='gzip')
            file[f'run/{name}'].attrs['units'] = name.rpartition('_')[2]


def tdms(path: Path) -> None:
    """Write a TDMS file of three segments."""
    with TdmsWriter(path) as writer:
        for part in (slice(0, 100), slice(100, 101), slice(101, COUNT)):
            writer.write_segment(
                [
                    ChannelObject('run', n, v[part], {'unit_string': n.rpartition('_')[2]})
                    for n, v in COLUMNS.items()
                ]
            )


def labview(path: Path) -> None:
    """Write a LabVIEW measurement file without a column of times."""
    rows = np.column_stack([COLUMNS['command_mm'], COLUMNS['measured_mm']]).tolist()
    lines = ['LabVIEW Measurement', 'Separator\tTab', 'X_Columns\tNo', '***End_of_Header***', '']
    lines += ['Channels\t2', 'Y_Unit_Label\tmm\tmm', 'X0\t0\t0', 'Delta_X\t0.001\t0.001']
    lines += ['***End_of_Header***', 'X_Value\tCommand\tMeasured\tComment']
    path.write_text('\n'.join([*lines, *(f'\t{u!r}\t{y!r}' for u, y in rows)]))


def parquet(path: Path) -> None:
    """Write a Parquet file of three groups."""
    pq.write_table(pa.table(COLUMNS), path, row_group_size=100)


def excel(path: Path) -> None:
    """Write a workbook."""
    book = openpyxl.Workbook()
    book.active.append(list(COLUMNS))
    for row in np.column_stack(list(COLUMNS.values()))[:50].tolist():
        book.active.append(row)
    book.save(path)


def mcap(path: Path) -> None:
    """Write a bag's file."""
    record = Record(
        COLUMNS['command_mm'] * 1e-3, COLUMNS['measured_mm'] * 1e-3, 1e-3, stiffness=0.0
    )
    folder = path.parent / f'{path.stem}_bag'
    with BagWriter(folder) as writer:
        write_record(writer, record, block=16)
    next(folder.glob('*.mcap')).rename(path)


def read_all(path: Path) -> None:
    """Read a file as every command might."""
    for use in (load_records, look, lambda p: load_records(p, channels=TOPICS)):
        with suppress(InputError):
            use(path)


def read_map(path: Path) -> None:
    """Read a channel map."""
    read_channel_map(path)


FORMATS: dict[str, tuple[str, Callable[[Path], object], Callable[[Path], object]]] = {
    'csv': ('.csv', csv, read_all),
    'mat': ('.mat', mat, read_all),
    'mat_6': ('.mat', mat_6, read_all),
    'hdf5': ('.h5', hdf5, read_all),
    'tdms': ('.tdms', tdms, read_all),
    'labview': ('.lvm', labview, read_all),
    'parquet': ('.parquet', parquet, read_all),
    'excel': ('.xlsx', excel, read_all),
    'mcap': ('.mcap', mcap, read_all),
    'map': ('.yaml', lambda p: p.write_text(MAP), read_map),
    'effects': ('.yaml', lambda p: p.write_text(EFFECTS), read_effects),
}
