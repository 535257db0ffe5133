"""TDMS, Parquet, MATLAB and HDF5 as their own libraries read them: equal, or refused."""

from pathlib import Path

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from nptdms import ChannelObject, TdmsFile, TdmsWriter
from scipy.io import savemat

from actuator_glue.errors import InputError
from actuator_glue.io.channel_map import ChannelMap, parse_channel_map
from actuator_glue.io.laboratory import read
from actuator_glue.io.look import look

COUNT = 400
RATE = 1000.0
TIME = np.arange(COUNT) / RATE
COMMAND = 10.0 * np.sin(2e-1 * np.arange(COUNT)) + 1e-3 * np.arange(COUNT)
MEASURED = 0.9 * np.roll(COMMAND, 15)
START = np.datetime64('2026-05-01T12:00:00', 'us')
START_NS = int(START.astype('datetime64[ns]').astype(np.int64))


def mapped(command: str | int, measured: str | int, **entries: object) -> ChannelMap:
    """Channel map of two columns in mm."""
    content = {
        'command': {'column': command, 'unit': 'mm'},
        'measured': {'column': measured, 'unit': 'mm'},
        **entries,
    }
    return parse_channel_map(content, 'test')


# TDMS: each waveform has a start and an increment of its own.


def waveform(
    period: float = 1e-3, start: object = START, offset: float = 0.0
) -> dict[str, object]:
    """Properties of a waveform as LabVIEW writes them; times to the microsecond."""
    found: dict[str, object] = {'wf_increment': period, 'wf_start_offset': offset}
    return found if start is None else {**found, 'wf_start_time': start}


def write_tdms(path: Path, *channels: tuple[str, np.ndarray, dict[str, object]]) -> Path:
    """Write channels of one group."""
    with TdmsWriter(path) as writer:
        writer.write_segment([ChannelObject('run', *channel) for channel in channels])
    return path


def in_hdf5(path: Path) -> Path:
    """Write the same channels with their properties to HDF5, as npTDMS does."""
    made = path.with_suffix('.h5')
    with TdmsFile.read(path).as_hdf(made):
        return made


def later(samples: float) -> np.datetime64:
    """Start so many samples after the first one."""
    return START + np.timedelta64(round(samples * 1000), 'us')


@pytest.mark.parametrize('behind', [0, 10, -7, 385])
@pytest.mark.parametrize('by', ['start', 'offset', 'both'])
def test_waveforms_of_tdms_are_aligned_by_their_starts(
    tmp_path: Path, behind: int, by: str
) -> None:
    """What was taken at one time is one sample, as npTDMS' own times have it."""
    share = {'start': 1.0, 'offset': 0.0, 'both': 3.0}[by]
    own = waveform(start=later(share * behind), offset=(1.0 - share) * behind * 1e-3)
    path = write_tdms(
        tmp_path / 'a.tdms', ('command_mm', COMMAND, waveform()), ('measured_mm', MEASURED, own)
    )
    times = [channel.time_track() for channel in TdmsFile.read(path)['run'].channels()]
    absolute = times[1] + 1e-3 * share * behind
    record = read(path)
    first, last = max(times[0][0], absolute[0]), min(times[0][-1], absolute[-1])
    wanted = (times[0] > first - 1e-4) & (times[0] < last + 1e-4)
    assert np.array_equal(record.command, 1e-3 * COMMAND[wanted])
    wanted = (absolute > first - 1e-4) & (absolute < last + 1e-4)
    assert np.array_equal(record.measured, 1e-3 * MEASURED[wanted])
    assert record.start_ns == START_NS + round(first * 1e9)
    by_map = read(path, channels=mapped('run/command_mm', 'run/measured_mm', rate=RATE))
    assert np.array_equal(by_map.measured, record.measured)
    assert by_map.start_ns == record.start_ns
    shown = {column.label: column.values for column in look(path).columns}
    assert np.array_equal(1e-3 * shown['measured_mm'], record.measured)
    same = read(in_hdf5(path))
    assert np.array_equal(same.command, record.command)
    assert np.array_equal(same.measured, record.measured)
    assert (same.period, same.start_ns) == (record.period, record.start_ns)


@pytest.mark.parametrize(
    ('own', 'told'),
    [
        (waveform(offset=0.0103), 'no whole number of samples'),
        (waveform(period=2e-3), 'measured_mm one every 0.002 s'),
        (waveform(period=1.00009e-3), 'measured_mm one every 0.00100009 s'),
        (waveform(offset=0.5), 'command_mm ends before another channel begins'),
        ({}, 'measured_mm has no start of its own'),
    ],
)
def test_waveforms_of_tdms_without_common_times_are_refused(
    tmp_path: Path, own: dict[str, object], told: str
) -> None:
    """Starts between samples, other rates, no overlap, no start at all beside others."""
    path = write_tdms(
        tmp_path / 'a.tdms',
        ('command_mm', COMMAND, waveform()),
        ('force_N', COMMAND, waveform(offset=0.002)),
        ('measured_mm', MEASURED, own),
    )
    with pytest.raises(InputError, match=told):
        read(path)


def parts(path: Path, *behind: float, period: float = 1e-3) -> Path:
    """Write waveforms in segments of half of the samples, each so many samples after the first."""
    with TdmsWriter(path) as writer:
        for begin, start in zip((0, COUNT // 2), behind, strict=True):
            part = slice(begin, begin + COUNT // 2)
            own = waveform(start=later(start), period=period if begin else 1e-3)
            writer.write_segment(
                [
                    ChannelObject('run', 'command_mm', COMMAND[part], own),
                    ChannelObject('run', 'measured_mm', MEASURED[part], own),
                ]
            )
    return path


def test_properties_of_other_meanings_beside_hdf5_are_none(tmp_path: Path) -> None:
    """What is no number, or no date, is no clock."""
    path = tmp_path / 'a.h5'
    with h5py.File(path, 'w') as file:
        for name, values in (('time_s', TIME), ('command_mm', COMMAND), ('measured_mm', MEASURED)):
            file[name] = values
            file[name].attrs.update({'wf_increment': 'one', 'wf_start_time': 'noon'})
    assert read(path).rate == pytest.approx(RATE)
    with h5py.File(path, 'a') as file:
        file['command_mm'].attrs['wf_increment'] = 2e-3
    with pytest.raises(InputError, match='said to be 500 Hz, but by its column of times it is'):
        read(path)


def test_segments_of_tdms_that_go_on_are_one_record(tmp_path: Path) -> None:
    """Each with its own start, stamped somewhat late, or all with the first one."""
    for second in (COUNT // 2, COUNT // 2 + 0.1, COUNT // 2 + 30, COUNT // 2 - 2, 0):
        record = read(parts(tmp_path / 'a.tdms', 0, second))
        assert record.start_ns == START_NS
        assert np.array_equal(record.command, 1e-3 * COMMAND)


def test_segments_of_tdms_that_begin_anew_are_refused(tmp_path: Path) -> None:
    """A minute or a moment later, or at another rate: no record is joined over that."""
    half = COUNT // 2
    for second in (half + 60_000, half + 100, half - 100):
        with pytest.raises(InputError, match=f'command_mm begins anew at sample {half}, .*each'):
            read(parts(tmp_path / 'a.tdms', 0, second))
    with pytest.raises(InputError, match=f'every 0.002 s from sample {half} on'):
        read(parts(tmp_path / 'a.tdms', 0, half, period=2e-3))


def stamped(path: Path, *starts: np.datetime64) -> Path:
    """Write waveforms in segments of as many samples each, with these starts."""
    ends = np.linspace(0, COUNT, len(starts) + 1).astype(int)
    with TdmsWriter(path) as writer:
        for begin, end, start in zip(ends[:-1], ends[1:], starts, strict=True):
            own = waveform(start=start)
            writer.write_segment(
                [
                    ChannelObject('run', 'command_mm', COMMAND[begin:end], own),
                    ChannelObject('run', 'measured_mm', MEASURED[begin:end], own),
                ]
            )
    return path


def test_stamps_of_segments_of_tdms_may_jitter_and_not_add_up(tmp_path: Path) -> None:
    """A clock that is milliseconds late each time goes on; samples missing each time do not."""
    every = COUNT // 8
    jitter = [0.0, 2.4, 1.1, 0.3, 1.9, 0.0, 2.2, 0.7]
    path = stamped(tmp_path / 'a.tdms', *[later(i * every + j) for i, j in enumerate(jitter)])
    assert np.array_equal(read(path).command, 1e-3 * COMMAND)
    stamped(path, *[later(i * (every + 20)) for i in range(8)])
    with pytest.raises(InputError, match=rf'begins anew at sample {3 * every}, 0\.06 s after'):
        read(path)


def test_a_short_gap_between_segments_of_tdms_is_told(tmp_path: Path) -> None:
    """Where all later segments are late, as stamps are not; a clock that drifts is none."""
    every, told = COUNT // 8, []
    for at in (1, 4, 7):
        late = [15.0 * (i >= at) + 0.7 * (i % 2) for i in range(8)]
        starts = [later(i * every + j) for i, j in enumerate(late)]
        read(stamped(tmp_path / 'a.tdms', *starts), warn=told.append)
        assert f'from sample {at * every} on begin some 1' in told.pop()
        assert not told
    odd = [0.0, 9.0, 3.0, 14.0, 2.0, 8.0, 0.0, 1.0]
    for late in (odd, [*odd[:7], 19.0], [-5.0, *odd[1:]], [0.02 * i for i in range(8)]):
        starts = [later(i * every + j) for i, j in enumerate(late)]
        read(stamped(tmp_path / 'a.tdms', *starts), warn=told.append)
        assert not told


def test_no_start_of_segments_of_tdms_is_none(tmp_path: Path) -> None:
    """LabVIEW's time zero in some segments: the record begins as those with a start say."""
    zero = np.datetime64('1904-01-01T00:00:00', 'us')
    half = later(COUNT // 2)
    for starts in ((zero, half), (later(0.0), zero), (zero, zero)):
        record = read(stamped(tmp_path / 'a.tdms', *starts))
        assert record.start_ns == (0 if starts == (zero, zero) else START_NS)
        assert np.array_equal(record.command, 1e-3 * COMMAND)


def test_times_of_tdms_that_its_waveforms_contradict_are_refused(tmp_path: Path) -> None:
    """A column of times at 500 Hz beside waveforms of 1 kHz; a map may say which counts."""
    path = tmp_path / 'a.tdms'
    for step in (1e-3, 2e-3):
        times = step * np.arange(COUNT)
        write_tdms(
            path,
            ('time_s', times, {}),
            ('command_mm', COMMAND, waveform()),
            ('measured_mm', MEASURED, waveform()),
        )
        if step == 1e-3:
            assert read(path).period == step
    with pytest.raises(InputError, match=r'said to be 1000 Hz, but by its column of times .* 500'):
        read(path)


def test_an_increment_that_nobody_gave_contradicts_no_times(tmp_path: Path) -> None:
    """LabVIEW writes 1 s where none was set; in HDF5 that was made of the file as well."""
    path = write_tdms(
        tmp_path / 'a.tdms',
        ('time_s', 2e-3 * np.arange(COUNT), {}),
        ('command_mm', COMMAND, waveform(period=1.0)),
        ('measured_mm', MEASURED, waveform(period=1.0)),
    )
    for one in (path, in_hdf5(path)):
        assert read(one).period == 2e-3


def test_waveforms_of_tdms_whose_increments_differ_in_their_last_digits(tmp_path: Path) -> None:
    """Increments that were divided by another number are one clock, asked for or not."""
    path = write_tdms(
        tmp_path / 'a.tdms',
        ('command_mm', COMMAND, waveform()),
        ('measured_mm', MEASURED, waveform(period=1e-3 * (1.0 + 1e-9))),
    )
    assert np.array_equal(read(path).measured, 1e-3 * MEASURED)
    assert len(look(path).columns) == 2


def test_a_slow_channel_that_nobody_asks_for_is_in_nobodys_way(tmp_path: Path) -> None:
    """A temperature once a second beside waveforms of 1 kHz."""
    path = write_tdms(
        tmp_path / 'a.tdms',
        ('temperature', np.arange(3.0), waveform(period=1.0, start=later(1.5))),
        ('command_mm', COMMAND, waveform()),
        ('measured_mm', MEASURED, waveform(offset=0.01)),
    )
    record = read(path)
    assert len(record) == COUNT - 10 and record.rate == RATE
    assert [len(column.values) for column in look(path).columns] == [3, COUNT - 10, COUNT - 10]


def test_without_a_start_the_offsets_of_waveforms_count(tmp_path: Path) -> None:
    """LabVIEW's time zero, 1904, is no start."""
    zero = np.datetime64('1904-01-01T00:00:00', 'us')
    for start in (None, zero):
        path = write_tdms(
            tmp_path / 'a.tdms',
            ('command_mm', COMMAND, waveform(start=start)),
            ('measured_mm', MEASURED, waveform(start=start, offset=0.01)),
        )
        record = read(path)
        assert np.array_equal(record.command, 1e-3 * COMMAND[10:])
        assert np.array_equal(record.measured, 1e-3 * MEASURED[:-10])
        assert record.start_ns == 10_000_000


# Parquet: what pandas writes.


def whole(unit: str) -> np.ndarray:
    """Absolute times in a unit, whole numbers."""
    ticks = np.arange(COUNT) * 1_000_000 + START_NS + 123
    return ticks // {'ns': 1, 'us': 1000, 'ms': 1_000_000}[unit]


@pytest.mark.parametrize(
    ('name', 'times'),
    [
        ('time_ns', pa.array(whole('ns'), pa.int64())),
        ('time_ns', pa.array(whole('ns').astype(np.uint64), pa.uint64())),
        ('time_us', pa.array(whole('us'), pa.int64())),
        ('time_ms', pa.array(whole('ms'), pa.int64())),
        ('time_s', pa.array(TIME + START_NS * 1e-9)),
        ('time', pa.array(whole('ns'), pa.timestamp('ns'))),
        ('time_ns', pa.array(whole('ns'), pa.timestamp('ns', tz='Europe/Berlin'))),
        ('time', pa.array(whole('ms'), pa.timestamp('ms'))),
    ],
)
def test_absolute_times_of_parquet_of_any_type(tmp_path: Path, name: str, times: pa.Array) -> None:
    """The same record, and the same start to a microsecond."""
    table = pa.table({name: times, 'command_mm': COMMAND, 'measured_mm': MEASURED})
    pq.write_table(table, tmp_path / 'a.parquet')
    record = read(tmp_path / 'a.parquet')
    assert record.rate == RATE
    assert np.array_equal(record.command, 1e-3 * COMMAND)
    assert record.start_ns == pytest.approx(START_NS, abs=1000)


@pytest.mark.parametrize(
    ('name', 'times'),
    [
        ('time', pa.array((TIME * 1e9).round().astype(np.int64), pa.duration('ns'))),
        ('time_ms', pa.array((TIME * 1e3).round().astype(np.int64), pa.duration('ms'))),
        ('time_ms', pa.array((TIME * 1e3).round().astype(np.uint16))),
        ('time', pa.array((TIME * 1e3).round().astype(np.int32), pa.time32('ms'))),
        ('time_us', pa.array((TIME * 1e6).round().astype(np.uint32))),
    ],
)
def test_relative_times_of_parquet_of_any_type(tmp_path: Path, name: str, times: pa.Array) -> None:
    """Durations, times of day, small whole numbers."""
    table = pa.table({name: times, 'command_mm': COMMAND, 'measured_mm': MEASURED})
    pq.write_table(table, tmp_path / 'a.parquet')
    record = read(tmp_path / 'a.parquet')
    assert record.rate == RATE and record.start_ns == 0


@pytest.mark.parametrize('kind', [pa.float32(), pa.int32(), pa.decimal128(9, 3), pa.float16()])
def test_numbers_of_parquet_of_any_type(tmp_path: Path, kind: pa.DataType) -> None:
    """As pyarrow itself reads them."""
    column = pa.array(np.round(100 * COMMAND)).cast(kind, safe=False)
    table = pa.table({'time_s': TIME, 'command_um': column, 'measured_mm': MEASURED})
    pq.write_table(table, tmp_path / 'a.parquet')
    record = read(tmp_path / 'a.parquet')
    expected = np.array(column.to_pylist(), dtype=float)
    assert np.allclose(record.command, 1e-6 * expected, rtol=1e-15)


@pytest.mark.parametrize('kind', [pa.float64(), pa.int32(), pa.float32()])
@pytest.mark.parametrize('name', ['command_mm', 'measured_mm', 'time_s'])
def test_what_is_missing_in_parquet_is_refused_with_its_place(
    tmp_path: Path, kind: pa.DataType, name: str
) -> None:
    """A null is no number, whatever lies in the file beneath it."""
    columns = {'time_s': TIME, 'command_mm': COMMAND, 'measured_mm': MEASURED}
    missing = np.arange(COUNT) == 123
    values = pa.array(np.round(columns[name]), mask=missing).cast(kind)
    pq.write_table(pa.table({**columns, name: values}), tmp_path / 'a.parquet')
    with pytest.raises(InputError, match=r'sample 123\b'):
        read(tmp_path / 'a.parquet')


# MATLAB: what version 7.3 holds is what version 5 holds.


def write_mat73(path: Path, variables: dict[str, object]) -> None:
    """Write variables as MATLAB writes version 7.3: turned arrays, structs by reference."""
    with h5py.File(path, 'w', userblock_size=512) as file:
        Mat73(file).group(file, variables)


class Mat73:
    """What MATLAB makes of variables in an HDF5 file."""

    def __init__(self, file: h5py.File) -> None:
        self.file, self.count = file, 0

    def group(self, group: h5py.Group, fields: dict[str, object]) -> None:
        """Write the fields of a struct, or all variables."""
        for name, value in fields.items():
            self.put(group, name, value)

    def put(self, group: h5py.Group, name: str, value: object) -> None:
        """Write one variable or field."""
        if isinstance(value, dict):
            made = group.create_group(name)
            made.attrs['MATLAB_class'] = np.bytes_(b'struct')
            self.group(made, value)
        elif isinstance(value, str):
            codes = np.array([[ord(c)] for c in value], dtype=np.uint16)
            group[name] = codes
            group[name].attrs['MATLAB_class'] = np.bytes_(b'char')
        elif isinstance(value, np.ndarray) and value.dtype == object:
            made = group.create_group(name)
            made.attrs['MATLAB_class'] = np.bytes_(b'struct')
            for field in value.flat[0]:
                references = np.empty(value.T.shape, dtype=h5py.ref_dtype)
                for at in np.ndindex(*value.shape):
                    references[at[::-1]] = self.reference(value[at][field])
                made.create_dataset(field, data=references, dtype=h5py.ref_dtype)
        else:
            array = np.asarray(value)
            if array.size:
                group[name] = array.T
            else:
                group[name] = np.array(array.shape, dtype=np.uint64)
                group[name].attrs['MATLAB_empty'] = np.uint8(1)
            group[name].attrs['MATLAB_class'] = np.bytes_(b'double')

    def reference(self, value: object) -> h5py.Reference:
        """Write a value where nobody sees it."""
        hidden = self.file.require_group('#refs#')
        self.count += 1
        self.put(hidden, f'v{self.count}', value)
        return hidden[f'v{self.count}'].ref


def savable(value: object) -> object:
    """Return a variable as `savemat` takes it: of a struct array a structured array."""
    if isinstance(value, dict):
        return {name: savable(entry) for name, entry in value.items()}
    if isinstance(value, np.ndarray) and value.dtype == object:
        made = np.empty(value.shape, dtype=[(name, object) for name in value.flat[0]])
        for at in np.ndindex(*value.shape):
            made[at] = tuple(savable(entry) for entry in value[at].values())
        return made
    return value


def structs(shape: tuple[int, ...], *fields: dict[str, object]) -> np.ndarray:
    """Return an array of structs, filled down its columns as MATLAB does."""
    made = np.empty(shape, dtype=object)
    for at, content in zip(np.ndindex(*shape[::-1]), fields, strict=True):
        made[at[::-1]] = content
    return made


def column(values: np.ndarray) -> np.ndarray:
    """Return a vector as MATLAB holds it."""
    return np.asarray(values, dtype=float).reshape(-1, 1)


FAMILY: dict[str, dict[str, object]] = {
    'columns': {'time_s': column(TIME), 'u': column(COMMAND), 'x': column(MEASURED)},
    'rows': {'time_s': column(TIME).T, 'u': column(COMMAND).T, 'x': column(MEASURED).T},
    'empty': {'time_s': column(TIME), 'force_N': np.empty((0, 0)), 'none': np.empty((1, 0))},
    'matrix': {'data': np.column_stack([TIME, COMMAND, MEASURED]), 'fs': np.array([[RATE]])},
    'lying matrix': {'data': np.column_stack([TIME, COMMAND, MEASURED]).T},
    '1x1xN': {'u': COMMAND.reshape(1, 1, -1), 'x': MEASURED.reshape(1, 1, -1)},
    'Nx1x2': {'y': np.stack([COMMAND, MEASURED], axis=1).reshape(-1, 1, 2)},
    '2x1xN': {'y': np.stack([COMMAND, MEASURED]).reshape(2, 1, -1)},
    'a cube': {'cube': np.arange(24.0).reshape(2, 3, 4), 'u': column(COMMAND)},
    'struct': {'run': {'time': column(TIME), 'sub': {'u': column(COMMAND)}, 'note': 'hold'}},
    'struct array': {
        'rec': {
            'X': {'Data': column(TIME)},
            'Y': structs(
                (1, 2),
                {'Data': column(COMMAND), 'Name': 'cmd', 'Unit': 'mm'},
                {'Data': column(MEASURED), 'Name': 'pos', 'Unit': 'mm'},
            ),
        }
    },
    'two-dimensional struct array': {
        'Y': structs((2, 3), *({'Data': column(COMMAND + i), 'Name': f'n{i}'} for i in range(6)))
    },
    'structs in struct arrays': {
        'scope': {
            'time': column(TIME),
            'signals': structs(
                (1, 2),
                {'values': COMMAND.reshape(1, 1, -1), 'label': 'u', 'plot': {'w': column([1, 2])}},
                {
                    'values': MEASURED.reshape(1, 1, -1),
                    'label': 'x',
                    'plot': {'w': column([3, 4])},
                },
            ),
        }
    },
}


@pytest.mark.parametrize('name', FAMILY)
def test_version_7_3_of_matlab_is_read_as_version_5(tmp_path: Path, name: str) -> None:
    """The same columns by name, label and unit, and the same numbers."""
    savemat(tmp_path / 'v5.mat', {k: savable(v) for k, v in FAMILY[name].items()})
    write_mat73(tmp_path / 'v73.mat', FAMILY[name])
    old, new = (
        {c.name: (c.label, c.unit, c.values) for c in look(tmp_path / f'{v}.mat').columns}
        for v in ('v5', 'v73')
    )
    assert sorted(map(str, old)) == sorted(map(str, new))
    for column_name, (label, unit, values) in old.items():
        assert new[column_name][:2] == (label, unit)
        assert np.array_equal(new[column_name][2], values)


def test_names_beside_the_data_of_structs_are_their_names(tmp_path: Path) -> None:
    """As ControlDesk writes them, and with units: no map is needed."""
    content = {
        'rec': {
            'Y': structs(
                (1, 3),
                {'Data': column(TIME), 'Name': 'time', 'Unit': 's'},
                {'Data': column(COMMAND), 'Name': 'Command', 'Unit': 'mm'},
                {'Data': column(MEASURED), 'Name': 'Measured', 'Unit': 'mm'},
            )
        }
    }
    savemat(tmp_path / 'v5.mat', {k: savable(v) for k, v in content.items()})
    write_mat73(tmp_path / 'v73.mat', content)
    for path in (tmp_path / 'v5.mat', tmp_path / 'v73.mat'):
        assert [c.label for c in look(path).columns] == ['time', 'Command', 'Measured']
        assert np.array_equal(read(path).measured, 1e-3 * MEASURED)


def test_an_empty_force_is_no_force(tmp_path: Path) -> None:
    """[] of version 7.3 is stored as its shape, which is no force of two samples."""
    named = {
        'time_s': column(TIME),
        'command_mm': column(COMMAND),
        'measured_mm': column(MEASURED),
    }
    write_mat73(tmp_path / 'v73.mat', {**named, 'force_N': np.empty((0, 0))})
    savemat(tmp_path / 'v5.mat', {**named, 'force_N': np.empty((0, 0))})
    for name in ('v5.mat', 'v73.mat'):
        record = read(tmp_path / name)
        assert record.force is None and np.array_equal(record.command, 1e-3 * COMMAND)


def test_references_that_lead_in_circles_end(tmp_path: Path) -> None:
    """Structs of which each holds all, as no MATLAB writes them."""
    with h5py.File(tmp_path / 'a.mat', 'w', userblock_size=512) as file:
        made = file.create_group('Y')
        loop = made.create_dataset('Data', (1000, 1), dtype=h5py.ref_dtype)
        loop[...] = np.full((1000, 1), made.ref, dtype=h5py.ref_dtype)
    with pytest.raises(InputError, match='structs'):
        read(tmp_path / 'a.mat')


# HDF5: netCDF packs its numbers (CF conventions).

PACKED = np.round(1000 * COMMAND).astype(np.int16)


@pytest.mark.parametrize(
    ('stored', 'attributes', 'expected'),
    [
        (PACKED, {'scale_factor': 0.5}, 0.5 * PACKED),
        (PACKED, {'scale_factor': np.array([0.25]), 'add_offset': -3.0}, 0.25 * PACKED - 3.0),
        (PACKED, {'add_offset': np.float32(7.0)}, PACKED + 7.0),
        (PACKED.view(np.int16), {'_Unsigned': 'true'}, PACKED.view(np.uint16).astype(float)),
        (PACKED, {'_FillValue': np.int16(-32768), 'valid_range': [-32767, 32767]}, PACKED + 0.0),
    ],
)
def test_packed_numbers_of_netcdf_are_unpacked(
    tmp_path: Path, stored: np.ndarray, attributes: dict[str, object], expected: np.ndarray
) -> None:
    """Factor and offset after the signs, as section 8.1 of the conventions has it."""
    with h5py.File(tmp_path / 'a.nc', 'w') as file:
        file['time_s'], file['command'], file['measured_mm'] = TIME, stored, MEASURED
        file['command'].attrs.update({'units': 'um', **attributes})
    assert np.allclose(read(tmp_path / 'a.nc').command, 1e-6 * expected, rtol=1e-14)


@pytest.mark.parametrize(
    'attributes',
    [
        {'_FillValue': np.int16(-99)},
        {'missing_value': np.array([5, -99], np.int16), 'scale_factor': 0.1},
        {'valid_min': np.int16(-98)},
        {'valid_range': np.array([-98, 32767], np.int16)},
    ],
)
def test_what_is_missing_in_netcdf_is_refused_with_its_place(
    tmp_path: Path, attributes: dict[str, object]
) -> None:
    """A fill value is no displacement."""
    stored = np.maximum(PACKED, 10)
    stored[321] = -99
    with h5py.File(tmp_path / 'a.nc', 'w') as file:
        file['time_s'], file['command'], file['measured_mm'] = TIME, stored, MEASURED
        file['command'].attrs.update({'units': 'um', **attributes})
    with pytest.raises(InputError, match=r'command .*sample 321\b'):
        read(tmp_path / 'a.nc')


def test_a_factor_that_is_no_number_is_refused(tmp_path: Path) -> None:
    """Nobody can say what was meant."""
    with h5py.File(tmp_path / 'a.nc', 'w') as file:
        file['time_s'], file['command'], file['measured_mm'] = TIME, PACKED, MEASURED
        file['command'].attrs.update({'units': 'um', 'scale_factor': 'half'})
    with pytest.raises(InputError, match='half'):
        read(tmp_path / 'a.nc')


def test_sample_numbers_that_a_float32_cannot_count_are_told_as_such(tmp_path: Path) -> None:
    """Not as samples that are missing."""
    for first, told in ((2**24 - 200, 'stored as float32'), (1000, '')):
        count = (first + np.arange(COUNT)).astype(np.float32)
        table = pa.table({'n': count, 'u': COMMAND, 'x': MEASURED})
        pq.write_table(table, tmp_path / 'a.parquet')
        channels = mapped('u', 'x', rate=RATE, sample_number='n')
        if told:
            with pytest.raises(InputError, match=told):
                read(tmp_path / 'a.parquet', channels=channels)
        else:
            assert len(read(tmp_path / 'a.parquet', channels=channels)) == COUNT


def test_columns_of_parquet_may_share_a_name(tmp_path: Path) -> None:
    """`map` called the file damaged."""
    columns = [np.arange(5.0) * k for k in (1, 2, 3, 4)]
    names = ['time_s', 'x', 'command_mm', 'x']
    table = pa.Table.from_arrays([pa.array(c) for c in columns], names=names)
    pq.write_table(table, tmp_path / 'a.parquet')
    found = look(tmp_path / 'a.parquet').columns
    assert [c.name for c in found] == ['time_s', 2, 'command_mm', 4]
    np.testing.assert_array_equal([c.values for c in found], columns)
