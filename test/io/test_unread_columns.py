"""A column with the name of a role that holds no real numbers is no column that is left out."""

from pathlib import Path

import numpy as np
import pytest

from actuator_glue.errors import InputError
from actuator_glue.io.laboratory import read

_COUNT = 500
_TIME = np.arange(_COUNT) / 250.0
_GOOD = {'time_s': _TIME, 'command_mm': np.sin(_TIME), 'measured_mm': np.sin(_TIME - 0.01)}
_TEXT = [f'{v:.3f}' for v in 100.0 * np.sin(_TIME)]


def _parquet(path: Path, columns: dict) -> None:
    pa, parquet = pytest.importorskip('pyarrow'), pytest.importorskip('pyarrow.parquet')
    parquet.write_table(pa.table(columns), path)


def _hdf5(path: Path, columns: dict) -> None:
    with pytest.importorskip('h5py').File(path, 'w') as file:
        for name, values in columns.items():
            file[name] = values


def _table_of_hdf5(path: Path, columns: dict) -> None:
    kinds = [(n, 'S9' if isinstance(v, list) else np.asarray(v).dtype) for n, v in columns.items()]
    rows = np.array(list(zip(*columns.values(), strict=True)), dtype=kinds)
    _hdf5(path, {'data': rows})


def _tdms(path: Path, columns: dict) -> None:
    nptdms = pytest.importorskip('nptdms')
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment([nptdms.ChannelObject('g', n, v) for n, v in columns.items()])


def _mat(path: Path, columns: dict) -> None:
    from scipy.io import savemat

    savemat(path, columns)


@pytest.mark.parametrize('role', ['measured_mm', 'force_N'])
@pytest.mark.parametrize(
    ('write', 'name', 'values'),
    [
        (_parquet, 'a.parquet', _TEXT),
        (_hdf5, 'a.h5', _TEXT),
        (_hdf5, 'a.h5', _TIME + 1j),
        (_table_of_hdf5, 'a.h5', _TEXT),
        (_tdms, 'a.tdms', _TEXT),
        (_mat, 'a.mat', _TIME + 1j),
    ],
)
def test_a_column_of_no_real_numbers_is_refused(write, name, values, role, tmp_path):
    write(tmp_path / name, {**_GOOD, role: values})
    with pytest.raises(InputError, match=f'{role}.*holds .* and no real numbers; save it as such'):
        read(tmp_path / name)


@pytest.mark.parametrize('extra', [{'force': [None] * _COUNT}, {'timestamp': _TEXT}])
def test_texts_that_nobody_needs_stay_unread(extra, tmp_path):
    _parquet(tmp_path / 'a.parquet', {**_GOOD, **extra})
    assert len(read(tmp_path / 'a.parquet')) == _COUNT


def test_a_word_is_no_column(tmp_path):
    for remark in ('of the load cell, not recorded', ['load cell A', 'not recorded']):
        _hdf5(tmp_path / 'a.h5', {**_GOOD, 'force': remark})
        assert read(tmp_path / 'a.h5').force is None


@pytest.mark.parametrize(
    ('write', 'name', 'extra'),
    [
        (_parquet, 'a.parquet', {'force_mode': _TEXT}),
        (_parquet, 'a.parquet', {'force': _TIME > 1.0}),
        (_hdf5, 'a.h5', {'force_sensor': _TEXT}),
        (_hdf5, 'a.h5', {'force': _TIME > 1.0}),
        (_hdf5, 'a.h5', {'list': np.array([(b'a', b'N')], [('name', 'S1'), ('force', 'S1')])}),
        (_tdms, 'a.tdms', {'force_mode': _TEXT}),
        (_mat, 'a.mat', {'force': 1.0 + 2.0j}),
    ],
)
def test_what_is_about_a_force_is_none(write, name, extra, tmp_path):
    write(tmp_path / name, {**_GOOD, **extra})
    assert read(tmp_path / name).force is None
