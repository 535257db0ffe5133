"""Records to laboratory files: CSV and MATLAB .mat, as `laboratory.read` reads them."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.records import Array, Record

_ROWS = 10_000  # rows formatted at a time


def _columns(record: Record, unit: str) -> dict[str, Array]:
    scale = {'m': 1.0, 'mm': 1e3}[unit]
    time = record.start_ns * 1e-9 + record.time
    columns = {'time_s': time}
    columns[f'command_{unit}'] = record.command * scale
    columns[f'measured_{unit}'] = record.measured * scale
    if record.force is not None:
        columns['force_N'] = record.force
    return columns


@contextmanager
def _whole(path: Path) -> Iterator[Path]:
    """Give a file to write beside `path` that takes its name once it is whole and on the disk."""
    temporary = path.with_name(path.name + '.tmp')
    try:
        yield temporary
        with temporary.open('rb') as written:
            os.fsync(written.fileno())
        temporary.replace(path)
    except OSError as error:
        raise InputError(f'{path}: cannot be written ({error.strerror or error})') from error
    finally:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)


def write_csv(
    path: Path | str,
    record: Record,
    *,
    unit: str = 'mm',
    progress: Callable[[int], None] | None = None,
) -> None:
    """Write a record as CSV, finished in one step; stiffness, hold and name as `#` lines.

    Args:
        path: file to write.
        record: what to write.
        unit: 'mm' for people, 'm' to lose not one bit.
        progress: called with the number of samples written since the last call.

    Raises:
        InputError: the file cannot be written.
    """
    path = Path(path)
    columns = _columns(record, unit)
    table = np.column_stack(list(columns.values()))
    with _whole(path) as temporary, temporary.open('w', encoding='utf-8', newline='\n') as file:
        if record.stiffness is not None:
            file.write(f'# stiffness_N_per_m = {record.stiffness!r}\n')
        file.write(f'# hold = {record.hold}\n# actuator = {record.actuator}\n')
        file.write(','.join(columns) + '\n')
        for start in range(0, len(table), _ROWS):
            rows = table[start : start + _ROWS].tolist()
            file.writelines(','.join(map(repr, row)) + '\n' for row in rows)
            if progress is not None:
                progress(len(rows))


def write_mat(path: Path | str, record: Record, *, unit: str = 'mm') -> None:
    """Write a record as .mat (version 5) with the same names as the CSV's columns.

    Raises:
        InputError: the file cannot be written.
    """
    from scipy.io import savemat

    path = Path(path)
    content: dict[str, object] = dict(_columns(record, unit))
    content['hold'] = record.hold
    content['actuator'] = record.actuator
    if record.stiffness is not None:
        content['stiffness_N_per_m'] = record.stiffness
    with _whole(path) as temporary:
        savemat(str(temporary), content, appendmat=False, do_compression=True)
