"""A sample rate that a file states beside its columns: held against its clock, or the clock."""

import json
import warnings
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import openpyxl
import pytest
from scipy.io import savemat

from actuator_glue.cli.main import main
from actuator_glue.errors import InputError
from actuator_glue.io.channel_map import parse_channel_map
from actuator_glue.io.join import join
from actuator_glue.io.laboratory import read
from actuator_glue.io.load import load

TIME = np.arange(4000) * 1e-3
MOVED = {'command_mm': 7.0 * np.sin(30 * TIME), 'measured_mm': 7.0 * np.sin(30 * TIME - 0.2)}
TIMED = {'time_s': TIME, **MOVED}


def text(path: Path, head: str, columns: dict[str, np.ndarray]) -> Path:
    """Write a text with lines above the names."""
    rows = np.column_stack(list(columns.values()))
    head = '\n'.join([*([head] if head else []), ','.join(columns)])
    np.savetxt(path, rows, fmt='%.6f', delimiter=',', header=head, comments='')
    return path


@pytest.mark.parametrize(
    ('note', 'said'),
    [
        ('sample rate: 1024 Hz', 'sample rate: 1024 Hz'),
        ('Sampling frequency = 2000', 'Sampling frequency = 2000'),
        ('Sample Rate (kHz): 2', 'Sample Rate (kHz): 2'),
        ('fs = 500 Hz', 'fs = 500 Hz'),
        ('sampling interval: 2 ms', 'sampling interval: 2 ms'),
        ('Abtastrate: 2000,0 Hz', 'Abtastrate: 2000,0 Hz'),
        ('sample rate [1/s]: 500', 'sample rate [1/s]: 500'),
        ('Samples per second: 500', 'Samples per second: 500'),
        ('dt: 2000 µs', 'dt: 2000 µs'),
        ('sample rate: 500 samples per second', 'sample rate: 500 samples per second'),
    ],
)
def test_a_rate_that_the_times_contradict_is_told(tmp_path: Path, note: str, said: str) -> None:
    told: list[str] = []
    record = read(text(tmp_path / 'a.csv', f'# {note}', TIMED), warn=told.append)
    assert record.rate == 1000.0
    (line,) = told
    assert f"it says '{said}', and is taken at 1000 Hz, as its column of times says" in line


def test_of_several_rates_each_that_is_another_is_told(tmp_path: Path) -> None:
    """Two that differ said nothing."""
    told: list[str] = []
    head = '# fs = 500\n# sample rate: 1000 Hz\n# sampling interval: 5 ms'
    assert read(text(tmp_path / 'a.csv', head, TIMED), warn=told.append).rate == 1000.0
    assert ["'fs = 500'" in line for line in told] == [True, False]
    assert "'sampling interval: 5 ms'" in told[1]


@pytest.mark.parametrize(
    'note',
    [
        'sample rate: 1000 Hz',
        'sample rate: 1,024 Hz',
        'Sample rate: 1 kHz',
        'sampling frequency: 1000.4 S/s',
        'dt = 0.001 s',
        'Frequency: 5 Hz',
        'filter = 200 Hz',
        'Sample rate of the camera: 30 Hz',
        'sample rate: 2048 Hz, decimated to 1000 Hz',
        'sample rate: see below',
        'sample interval: 1',
        'Sampling period: 60 s',
        'Sample number: 12',
    ],
)
def test_what_contradicts_nothing_is_not_told(tmp_path: Path, note: str) -> None:
    told: list[str] = []
    assert read(text(tmp_path / 'a.csv', f'# {note}', TIMED), warn=told.append).rate == 1000.0
    assert not told


@pytest.mark.parametrize('note', ['sample rate: 500 Hz', 'fs = 500', 'dt = 2 ms'])
def test_without_times_the_rate_that_is_stated_counts(tmp_path: Path, note: str) -> None:
    """It was refused, and asked for a channel map that repeats what stands there."""
    told: list[str] = []
    path = text(tmp_path / 'a.csv', f'# {note}', MOVED)
    assert read(path, warn=told.append).rate == 500.0
    assert told == [f'{path}: no column of times; {note!r} is taken, as it says']
    out = tmp_path / 'map.json'
    assert main(['map', str(path), '--json', str(out)]) == 0
    assert 'rate: 500  #' in json.loads(out.read_text())['map']


@pytest.mark.parametrize('name', ['t [s]', 'Zeit', 't', 'elapsed [ms]', 'Date'])
def test_a_column_that_may_be_of_times_is_not_passed_over(tmp_path: Path, name: str) -> None:
    path = text(tmp_path / 'a.csv', '# sample rate: 500 Hz', {name: TIME, **MOVED})
    with pytest.raises(InputError, match='no column for time'):
        read(path)


def test_a_part_of_a_test_needs_times(tmp_path: Path) -> None:
    """A rate does not say when the command began."""
    command = text(tmp_path / 'a.csv', '# fs = 1000', {'command_mm': MOVED['command_mm']})
    response = {'time_s': TIME, 'measured_mm': MOVED['measured_mm']}
    with pytest.raises(InputError, match='no column for time'):
        join(command, text(tmp_path / 'b.csv', '', response))


@pytest.mark.parametrize(
    'head', ['# fs = 500\n# sample rate: 1000 Hz', '# dt = 0.002', '# rate = 500']
)
def test_what_is_not_clear_is_no_clock(tmp_path: Path, head: str) -> None:
    """Two rates, a time without a unit, a rate of what."""
    with pytest.raises(InputError, match='no column for time'):
        read(text(tmp_path / 'a.csv', head, MOVED))


@pytest.mark.parametrize('head', ['Sample rate: 500 Hz', 'Sample Rate,500,Hz', 'fs\t500\tHz'])
def test_what_a_channel_map_says_counts(tmp_path: Path, head: str) -> None:
    """Also lines without a `#`, which are read beside a map only."""
    content = {
        'header_lines': 2,
        'command': {'column': 'command_mm', 'unit': 'mm'},
        'measured': {'column': 'measured_mm', 'unit': 'mm'},
    }
    path = text(tmp_path / 'a.csv', head, MOVED)
    told: list[str] = []
    same, other = (parse_channel_map({**content, 'rate': rate}, 'map') for rate in (500, 1000))
    assert read(path, channels=same, warn=told.append).rate == 500.0
    assert not told
    assert read(path, channels=other, warn=told.append).rate == 1000.0
    (line,) = told
    assert 'is taken at 1000 Hz, as channel map or waveform say' in line


def matlab(path: Path) -> None:
    """Write what people save: `save('a.mat', 'fs', 'command_mm', 'measured_mm')`."""
    savemat(path, {'fs': 500.0, **MOVED})


def attribute(path: Path) -> None:
    """Write HDF5 with an attribute of the file."""
    with h5py.File(path, 'w') as file:
        file.attrs['sample_rate'] = 500
        file.update(MOVED)


def scalar(path: Path) -> None:
    """Write HDF5 with numbers beside the vectors."""
    with h5py.File(path, 'w') as file:
        file['fs'], file['stiffness_N_per_m'] = 500.0, 250e3
        file.update(MOVED)


def group(path: Path) -> None:
    """Write HDF5 with an attribute of a group."""
    with h5py.File(path, 'w') as file:
        run = file.create_group('run')
        run.attrs['sample_rate_hz'] = 500
        run.update(MOVED)


def sheet(path: Path) -> None:
    """Write a workbook with a setting above the names."""
    book = openpyxl.Workbook()
    book.active.append(['Sample rate', 500, 'Hz'])
    book.active.append(list(MOVED))
    for row in zip(*MOVED.values(), strict=True):
        book.active.append(row)
    book.save(path)


@pytest.mark.parametrize(
    ('name', 'make'),
    [('a.mat', matlab), ('a.h5', attribute), ('b.h5', scalar), ('c.h5', group), ('a.xlsx', sheet)],
)
def test_other_formats_state_it_as_well(
    tmp_path: Path, name: str, make: Callable[[Path], None]
) -> None:
    make(tmp_path / name)
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter('always')
        record = load(tmp_path / name)
    assert record.rate == 500.0
    assert 'no column of times' in str(told[0].message)
    assert told[0].filename == __file__  # the line of whoever asked
    assert record.stiffness == (250e3 if make is scalar else None)


@pytest.mark.parametrize(
    ('head', 'decimal', 'rate'),
    [
        ('# Abtastrate: 10.000 Hz', ',', None),
        ('# Abtastrate: 1000,0 Hz', ',', 1000.0),
        ('# Abtastrate: 10.000 Hz', '.', 10.0),
        ('# sample rate: 1000\n# sample rate: 500', '.', None),
        ('# sample rate: 1000\n# sample rate: 1000', '.', 1000.0),
    ],
)
def test_a_rate_that_may_mean_two_is_none(
    tmp_path: Path, head: str, decimal: str, rate: float | None
) -> None:
    """A point beside decimal commas may part thousands; of two rates the last one counted."""
    path = tmp_path / 'a.csv'
    rows = np.column_stack(list(MOVED.values()))
    np.savetxt(path, rows, fmt='%.6f', delimiter=';', header=';'.join(MOVED), comments='')
    path.write_text(f'{head}\n{path.read_text().replace(".", decimal)}')
    if rate is None:
        with pytest.raises(InputError, match='no column for time'):
            read(path)
    else:
        assert read(path, warn=lambda _: None).rate == rate


@pytest.mark.parametrize('hold', [1.0, True, 5.0])
def test_a_number_called_hold_in_hdf5_is_none_of_a_command(tmp_path: Path, hold: object) -> None:
    """A dataset of one number refused the file."""
    with h5py.File(tmp_path / 'a.h5', 'w') as file:
        file.update(TIMED)
        file['hold'] = hold
    assert read(tmp_path / 'a.h5').hold == 'zoh'
