"""Records to laboratory files of every format, as `laboratory.read` reads them."""

from __future__ import annotations

from pathlib import Path

from actuator_glue.errors import InputError
from actuator_glue.io.formats import formats, writable
from actuator_glue.motion import METRES, MOTIONS, WRITTEN
from actuator_glue.records import Array, Record
from actuator_glue.whole_file import whole_file


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
    with whole_file(path) as temporary:
        chosen.write(temporary, _columns(record, unit), notes)
