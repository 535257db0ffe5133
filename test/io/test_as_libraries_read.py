"""Excel, MATLAB, Parquet, HDF5 and TDMS over a family of files, as their libraries read them."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from nptdms import ChannelObject, TdmsFile, TdmsWriter
from scipy.io import loadmat, savemat

from actuator_glue.io.laboratory import read
from actuator_glue.io.look import look

PERIOD = 4e-3
NAMES = ('time_s', 'command_mm', 'measured_mm', 'force_kN', 'temperature', 'count')
KINDS = ('float64', 'float32', 'int32', 'int16')


@dataclass(frozen=True)
class Made:
    """A table as somebody saved it."""

    table: pd.DataFrame
    inside: str  # struct or group; empty for none
    lying: bool  # vectors of MATLAB as rows
    packed: bool
    parts: int  # chunks that were appended


@st.composite
def tables(draw: st.DrawFn) -> Made:
    """Draw columns in any order and kind of number, of which some are spare."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    rows = draw(st.integers(30, 80))
    first = draw(st.sampled_from([0.0, 2.0]))
    columns = {'time_s': first + PERIOD * np.arange(rows)}
    for name in NAMES[1 : draw(st.integers(3, len(NAMES)))]:
        values = rng.uniform(-9e3, 9e3, rows)
        columns[name] = values.astype(draw(st.sampled_from(KINDS)))
    order = draw(st.permutations(list(columns)))
    return Made(
        pd.DataFrame({name: columns[name] for name in order}),
        draw(st.sampled_from(['', 'run_7'])),
        draw(st.booleans()),
        draw(st.booleans()),
        draw(st.integers(1, 3)),
    )


def matlab(path: Path, made: Made) -> dict[str, np.ndarray]:
    """Write variables or a struct; return them as scipy reads them."""
    shape = (1, -1) if made.lying else (-1, 1)
    vectors = {name: made.table[name].to_numpy().reshape(shape) for name in made.table}
    saved = {made.inside: vectors} if made.inside else vectors
    savemat(path, saved, do_compression=made.packed)
    found = loadmat(path, squeeze_me=True, struct_as_record=False)
    held = vars(found[made.inside]) if made.inside else found
    return {name: held[name] for name in made.table}


def hdf5(path: Path, made: Made) -> dict[str, np.ndarray]:
    """Write datasets, perhaps in a group; return them as h5py reads them."""
    place = made.inside + '/' if made.inside else ''
    with h5py.File(path, 'w') as file:
        for name in made.table:
            packing = 'gzip' if made.packed else None
            values = made.table[name].to_numpy()
            file.create_dataset(place + name, data=values, compression=packing)
    with h5py.File(path) as file:
        return {name: file[place + name][:] for name in made.table}


def parquet(path: Path, made: Made) -> dict[str, np.ndarray]:
    """Write with pandas, as it reads it."""
    packing = 'gzip' if made.packed else None
    rows = len(made.table) // made.parts
    made.table.to_parquet(path, compression=packing, row_group_size=rows, index=False)
    return {name: column.to_numpy() for name, column in pd.read_parquet(path).items()}


def excel(path: Path, made: Made) -> dict[str, np.ndarray]:
    """Write with pandas, as it reads it."""
    made.table.to_excel(path, index=False)
    return {name: column.to_numpy() for name, column in pd.read_excel(path).items()}


def tdms(path: Path, made: Made) -> dict[str, np.ndarray]:
    """Write segments, as LabVIEW appends them; return the channels as npTDMS reads them."""
    group = made.inside or 'Untitled'
    with TdmsWriter(path) as writer:
        for part in np.array_split(np.arange(len(made.table)), made.parts):
            channels = [(name, made.table[name].to_numpy()[part]) for name in made.table]
            writer.write_segment([ChannelObject(group, *channel) for channel in channels])
    with TdmsFile.open(path) as file:
        return {name: file[group][name][:] for name in made.table}


@pytest.mark.parametrize(
    ('suffix', 'write'),
    [
        ('.mat', matlab),
        ('.h5', hdf5),
        ('.parquet', parquet),
        ('.xlsx', excel),
        ('.tdms', tdms),
    ],
)
@settings(
    max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(made=tables())
def test_every_value_is_that_of_the_library(
    tmp_path: Path, suffix: str, write: Callable[[Path, Made], dict[str, np.ndarray]], made: Made
) -> None:
    """All columns under their names, whatever their order; and the record in SI units."""
    path = tmp_path / f'a{suffix}'
    with warnings.catch_warnings(action='ignore'):  # of pandas about its own options
        theirs = write(path, made)
    ours = {column.label: column.values for column in look(path).columns}
    assert sorted(ours) == sorted(theirs)
    for name, values in theirs.items():
        np.testing.assert_array_equal(ours[name], values.astype(np.float64), err_msg=name)
    record = read(path)
    scales = {'command_mm': 1e-3, 'measured_mm': 1e-3, 'force_kN': 1e3}
    for name, scale in scales.items():
        found = getattr(record, name.partition('_')[0])
        assert (found is None) == (name not in theirs)
        if found is not None:
            np.testing.assert_allclose(found, scale * theirs[name].astype(np.float64), rtol=1e-15)
    assert record.period == pytest.approx(PERIOD, rel=1e-9)
