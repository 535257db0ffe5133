"""Whether the channels of a stream can be what they are said to be, judged as those of a file."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.hygiene.checks import check
from actuator_glue.online.sensor_noise import white_noise
from actuator_glue.online.window_posterior import EXCITATION
from actuator_glue.records import Array, Record

# Samples are joined to means over so long [s]: a stream of 20 kHz takes no longer than another.
_MEANS = 1e-3
# Stretches in a row that must speak against the channels, before anything is said.
_IN_A_ROW = 2


def fault(stretch: Record) -> str | None:
    """Return what speaks against the channels of a stretch; empty where nothing does.

    None where it says nothing, because nothing moves: a stretch at rest is no test.
    """
    moved = float(stretch.command.std())
    if moved == 0.0 or moved <= EXCITATION * white_noise(stretch.measured):
        return None
    try:
        check(replace(_coarser(stretch), source='the stream'))
    except InputError as error:
        return str(error).removeprefix('the stream: ')
    return ''


def _coarser(record: Record) -> Record:
    size = int(_MEANS / record.period + 1e-9)
    if size < 2:
        return record

    def means(values: Array) -> Array:
        count = len(values) // size
        return np.asarray(values[: count * size].reshape(count, size).mean(axis=1))

    return replace(
        record,
        command=means(record.command),
        measured=means(record.measured),
        force=None if record.force is None else means(record.force),
        period=size * record.period,
    )


class ChannelFault:
    """What speaks against the channels of a stream, for as long as it does.

    Attributes:
        fault: in the words in which it was found first; empty where nothing is known to.
    """

    def __init__(self) -> None:
        self.fault = ''
        self._odd = 0

    def take(self, found: str | None) -> None:
        """Take what `fault` says of the next stretch."""
        if found is None:
            return
        self._odd = self._odd + 1 if found else 0
        if not found:
            self.fault = ''
        elif self._odd >= _IN_A_ROW:
            self.fault = self.fault or found
