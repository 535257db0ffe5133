"""Files as laboratories have them, five formats, whole and broken; no code of the package."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from benchmarks.laboratory.machines import RATE, Array

BROKEN = ('cut', 'gap', 'dead', 'garbage', 'empty')


def _csv(path: Path, u: Array, x: Array) -> None:
    t = np.arange(len(u)) / RATE
    table = np.column_stack([t, 1e3 * u, 1e3 * x])
    np.savetxt(
        path,
        table,
        delimiter=',',
        header='time_s,command_mm,measured_mm',
        comments='',
        fmt=('%.4f', '%.7f', '%.7f'),
    )


def _controller(path: Path, u: Array, x: Array) -> None:
    """Text of a controller, semicolons and commas, in volts: one channel map for all of it."""
    lines = ['Pruefstand West', 'Abtastrate 200 Hz', 'Soll [V];Ist [V]']
    numbers = (f'{500.0 * a:.6f};{500.0 * b:.6f}' for a, b in zip(u, x, strict=True))
    path.write_text('\n'.join([*lines, *(n.replace('.', ',') for n in numbers)]) + '\n')


def _mat(path: Path, u: Array, x: Array) -> None:
    from scipy.io import savemat

    savemat(path, {'time_s': np.arange(len(u)) / RATE, 'command_m': u, 'measured_m': x})


def _hdf5(path: Path, u: Array, x: Array) -> None:
    import h5py

    with h5py.File(path, 'w') as file:
        for name, column in (
            ('time_s', np.arange(len(u)) / RATE),
            ('command_m', u),
            ('measured_m', x),
        ):
            file[name] = column


def _parquet(path: Path, u: Array, x: Array) -> None:
    import pandas as pd

    t = np.arange(len(u)) / RATE
    pd.DataFrame({'time_s': t, 'command_mm': 1e3 * u, 'measured_mm': 1e3 * x}).to_parquet(path)


def _tdms(path: Path, u: Array, x: Array) -> None:
    from nptdms import ChannelObject, TdmsWriter

    waveform = {'wf_increment': 1.0 / RATE, 'wf_start_offset': 0.0, 'unit_string': 'mm'}
    with TdmsWriter(path) as file:
        file.write_segment(
            [
                ChannelObject('test', name, 1e3 * column, properties=waveform)
                for name, column in (('command', u), ('measured', x))
            ]
        )


# Suffix and writer of each; a machine's logger is another one after half of the time.
FORMATS: dict[str, tuple[str, Callable[[Path, Array, Array], None]]] = {
    'csv': ('.csv', _csv),
    'controller': ('.asc', _controller),
    'mat': ('.mat', _mat),
    'hdf5': ('.h5', _hdf5),
    'parquet': ('.parquet', _parquet),
    'tdms': ('.tdms', _tdms),
}
LOGGERS = {
    'north': ('csv', 'parquet'),
    'south': ('mat', 'hdf5'),
    'east': ('hdf5', 'tdms'),
    'west': ('controller', 'controller'),
}


def break_file(
    path: Path,
    kind: str,
    write: Callable[[Path, Array, Array], None],
    u: Array,
    x: Array,
    rng: np.random.Generator,
) -> None:
    """Write a file of which nothing can be made: cut off, with a gap, dead, garbage, empty."""
    if kind == 'gap':  # a channel without numbers
        x = x.copy()
        x[len(x) // 3 : len(x) // 2] = np.nan
    if kind == 'dead':  # a sensor that hangs
        x = np.full_like(x, x[0])
    write(path, u, x)
    whole = path.read_bytes()
    if kind == 'cut':
        path.write_bytes(whole[: len(whole) // 50])
    if kind == 'garbage':
        path.write_bytes(rng.bytes(2000))
    if kind == 'empty':
        path.write_bytes(b'')
