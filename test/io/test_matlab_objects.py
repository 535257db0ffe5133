"""Objects of MATLAB as its users save them, written with the library that knows them best."""

import sys
import warnings
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from matio import load_from_mat, save_to_mat
from matio.utils.matclass import MatlabOpaque

from actuator_glue.errors import InputError
from actuator_glue.io.channel_map import parse_channel_map
from actuator_glue.io.laboratory import read
from actuator_glue.io.look import look
from actuator_glue.records import Record

COUNT, PERIOD = 800, 5e-4  # half a millisecond: what is kept in whole ones would show
TIME = np.arange(COUNT) * PERIOD
COMMAND = np.sin(20 * TIME)  # mm
MEASURED = np.cos(20 * TIME)  # mm
VERSIONS = ('v7', 'v7.3')
NOTHING = np.zeros((0, 0))


def number(value: float) -> np.ndarray:
    """Return a number as MATLAB has it."""
    return np.array([[float(value)]])


def timeseries(
    name: str, values: np.ndarray, *, times: np.ndarray | None = None, units: str = 'seconds'
) -> MatlabOpaque:
    """Return a timeseries; one with even times keeps only start, step and length of them."""
    info = {
        'Units': units,
        'Start_': number(0.0),
        'End_': NOTHING,
        'Increment_': number(PERIOD if times is None else np.nan),
        'Length': number(COUNT),
    }
    return MatlabOpaque(
        properties={
            'Name': name,
            'Data_': values.reshape(-1, 1),
            'Time_': NOTHING if times is None else times.reshape(-1, 1),
            'TimeInfo': MatlabOpaque(properties=info, classname='tsdata.timemetadata'),
            'DataInfo': MatlabOpaque({'Units': 'mm'}, 'tsdata.datametadata'),
        },
        classname='timeseries',
    )


def dataset(*signals: MatlabOpaque) -> MatlabOpaque:
    """Return what Simulink logs: a Dataset of signals, each with a timeseries."""
    cell = np.empty((len(signals), 1), dtype=object)
    for i, values in enumerate(signals):
        said = {'Name': values.properties['Name'], 'PropagatedName': '', 'Values': values}
        cell[i, 0] = MatlabOpaque(said, 'Simulink.SimulationData.Signal')
    storage = MatlabOpaque({'Elements': cell}, 'Simulink.SimulationData.Storage.RamDatasetStorage')
    return MatlabOpaque(
        {'Name': 'logsout', 'Storage_': storage}, 'Simulink.SimulationData.Dataset'
    )


def saved(path: Path, version: str, **content: object) -> Path:
    """Save variables."""
    with warnings.catch_warnings(action='ignore'):
        save_to_mat(str(path), content, version=version)
    return path


def check(record: Record) -> None:
    """Compare with what was written."""
    np.testing.assert_allclose(record.command, COMMAND * 1e-3, rtol=1e-12, atol=1e-18)
    np.testing.assert_allclose(record.measured, MEASURED * 1e-3, rtol=1e-12, atol=1e-18)
    assert record.period == PERIOD


@pytest.mark.parametrize('version', VERSIONS)
@pytest.mark.parametrize('times', [None, TIME])
def test_timeseries(tmp_path: Path, version: str, times: np.ndarray | None) -> None:
    """Called as their variable or as they say; even times or a column of them; units."""
    content = {
        'a': timeseries('command', COMMAND, times=times),
        'b': timeseries('measured', MEASURED, times=times),
    }
    path = saved(tmp_path / 'a.mat', version, **content)
    check(read(path))
    assert [c.name for c in look(path).columns] == ['a.Time', 'a.Data', 'b.Data']
    named = {
        'time': {'column': 'a.Time', 'unit': 's'},
        'command': {'column': 'a.Data', 'unit': 'mm'},
        'measured': {'column': 'b.Data', 'unit': 'mm'},
    }
    check(read(path, channels=parse_channel_map(named, 'map')))


@pytest.mark.parametrize('version', VERSIONS)
def test_a_dataset_of_simulink(tmp_path: Path, version: str) -> None:
    """Its signals are called as MATLAB's own `logsout{1}` is."""
    signals = dataset(timeseries('command', COMMAND), timeseries('measured', MEASURED))
    path = saved(tmp_path / 'a.mat', version, logsout=signals)
    check(read(path))
    names = [c.name for c in look(path).columns]
    assert names == ['logsout{1}.Time', 'logsout{1}.Data', 'logsout{2}.Data']


@pytest.mark.parametrize('version', VERSIONS)
def test_timetable_and_table(tmp_path: Path, version: str) -> None:
    """Durations keep their half milliseconds; a table has its times among its variables."""
    columns = {'command_mm': COMMAND, 'measured_mm': MEASURED}
    index = pd.to_timedelta(1e9 * TIME, unit='ns').astype('timedelta64[us]')
    rows = pd.DataFrame(columns, index=index)
    rows.index.name = 'Time'
    # The library writes durations in whole units; MATLAB has them in milliseconds and fractions.
    path = saved(tmp_path / 'a.mat', version, tt=pd.DataFrame({'time_s': TIME, **columns}))
    check(read(path))
    with warnings.catch_warnings(action='ignore'):
        save_to_mat(str(tmp_path / 'b.mat'), {'tt': rows}, version=version)
    check(read(tmp_path / 'b.mat'))


@pytest.mark.parametrize('version', VERSIONS)
@pytest.mark.parametrize('timed', [True, False])
def test_names_of_variables_that_are_no_identifiers(
    tmp_path: Path, version: str, timed: bool
) -> None:
    """MATLAB keeps them beside identifiers that it makes of them, which say no unit."""
    columns = {'Command [mm]': COMMAND, 'Measured [mm]': MEASURED}
    index = pd.to_timedelta(1e9 * TIME, unit='ns').astype('timedelta64[us]')
    frame = pd.DataFrame(columns, index=index) if timed else pd.DataFrame(columns)
    if timed:
        frame.index.name = 'Time'
    else:
        frame['Time [s]'] = TIME
    path = saved(tmp_path / 'a.mat', version, t=frame)
    table = load_from_mat(str(path), raw_data=True)['t']
    held = table.properties['any'] if timed else table.properties['props']
    own, use = (
        ('varNamesOrig', 'useVarNamesOrig')
        if timed
        else (
            'VariableNamesOriginal',
            'useVariableNamesOriginal',
        )
    )
    names, place = ('varNames', held[0, 0]) if timed else ('varnames', table.properties)
    held[0, 0][own], held[0, 0][use] = place[names], np.array([[True]])
    made = np.empty(place[names].shape, dtype=object)
    made[0, :] = [f'variable_{i}' for i in range(made.size)]
    place[names] = made
    check(read(saved(path, version, t=table)))


@pytest.mark.parametrize('version', VERSIONS)
def test_other_times_are_refused(tmp_path: Path, version: str) -> None:
    """Two signals of one length that were sampled at other times are no record."""
    late = timeseries('measured', MEASURED, times=TIME + 0.25)
    path = saved(
        tmp_path / 'a.mat', version, logsout=dataset(timeseries('command', COMMAND), late)
    )
    with pytest.raises(InputError, match='have times of their own, and they differ'):
        read(path)


def test_other_units_of_time(tmp_path: Path) -> None:
    """What MATLAB knows is seconds afterwards; what it does not is refused."""
    for units, scale in (('milliseconds', 1e3), ('minutes', 1.0 / 60.0)):
        both = [
            timeseries(n, v, times=scale * TIME, units=units)
            for n, v in (('command', COMMAND), ('measured', MEASURED))
        ]
        check(read(saved(tmp_path / 'a.mat', 'v7.3', logsout=dataset(*both))))
    odd = timeseries('command', COMMAND, units='fortnights')
    with pytest.raises(InputError, match='fortnights are not understood'):
        read(saved(tmp_path / 'a.mat', 'v7.3', a=odd))


@pytest.mark.parametrize('version', VERSIONS)
def test_vectors_beside_objects_need_no_library(
    tmp_path: Path, version: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Objects alone say what is missing."""
    beside = {'time_s': TIME, 'command_mm': COMMAND, 'measured_mm': MEASURED}
    path = saved(tmp_path / 'a.mat', version, note=timeseries('x', COMMAND), **beside)
    alone = saved(tmp_path / 'b.mat', version, note=timeseries('x', COMMAND))
    check(read(path))
    monkeypatch.setitem(sys.modules, 'matio', None)
    monkeypatch.setattr('actuator_glue.io.formats.matlab.find_spec', lambda _: None)
    check(read(path))
    with pytest.raises(InputError, match=r'matio is needed.*actuator_glue\[lab\]'):
        read(alone)
