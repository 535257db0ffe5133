"""Records to laboratory files of every format, as `laboratory.read` reads them."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from actuator_glue.errors import InputError
from actuator_glue.io.formats import formats, writable
from actuator_glue.motion import METRES, MOTIONS, WRITTEN
from actuator_glue.records import Array, Record


def _columns(record: Record, unit: str) -> dict[str, Array]:
    scale = {'m': 1.0, 'mm': 1e3}[unit]
    if record.motion != METRES:
        unit = WRITTEN[record.motion]
        scale = 1.0 / MOTIONS[unit][1]
    time = record.start_ns * 1e-9 + record.time
    columns = {'time_s': time}
    columns[f'command_{unit}'] = record.command * scale
    columns[f'measured_{unit}'] = record.measured * scale
    if record.force is not None:
        columns['force_Nm' if record.motion == 'deg' else 'force_N'] = record.force
    return columns


@contextmanager
def _whole(path: Path) -> Iterator[Path]:
    """Yield a file beside `path` that is renamed to it once it is complete and on the disk."""
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


def write(path: Path | str, record: Record, *, unit: str = 'mm') -> None:
    """Write a record in the format of its suffix, finished in one step.

    Args:
        path: file to write.
        record: what to write; stiffness, hold and name of the actuator go along.
        unit: 'mm' for people, 'm' to lose not one bit.

    Raises:
        InputError: the file cannot be written.
    """
    path = Path(path)
    notes: dict[str, str | float] = {'hold': record.hold, 'actuator': record.actuator}
    if record.stiffness is not None:
        notes = {'stiffness_N_per_m': record.stiffness, **notes}
    chosen = formats().get(path.suffix.lower(), formats()['.csv'])
    if chosen.write is None:
        raise InputError(f'{path}: {chosen.name} is only read; use one of {", ".join(writable())}')
    with _whole(path) as temporary:
        chosen.write(temporary, _columns(record, unit), notes)
