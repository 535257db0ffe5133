"""Whether the channels of a stream can be what they are said to be, judged as those of a file."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.hygiene.checks import check
from actuator_glue.motion import spoken
from actuator_glue.online.sensor_noise import white_noise
from actuator_glue.online.window_posterior import EXCITATION
from actuator_glue.records import Array, Record

# Samples are joined to means over so long [s]: a stream of 20 kHz takes no longer than another.
_MEANS = 1e-3
# Range of a command that is a test [m]; the share of its standard deviation that each of so many
# parts must have. In a file there is a whole test; in a stretch maybe a rest, a hold or the end of
# a step, where a good sensor shows its last digit, or what was commanded before.
_RANGE, _SHARE, _PARTS = 1e-4, 0.03, 5
# How often a command must cross its mean, by half of its standard deviation either way, before a
# force is judged: in a single stroke a drift is proportional to the displacement.
_CROSSINGS = 4
# Stretches in a row that must speak against the channels, before anything is said.
_IN_A_ROW = 2


def fault(stretch: Record) -> str | None:
    """Return what speaks against the channels of a stretch; empty where nothing does.

    None where it says nothing, because the command does not move all the time.
    """
    if not _moves(stretch.command):
        return None
    told = stretch if _crossings(stretch.command) >= _CROSSINGS else replace(stretch, force=None)
    try:
        check(replace(_coarser(told), source='the stream'))
    except InputError as error:
        return spoken(str(error).removeprefix('the stream: '), stretch.motion)
    return ''


def _moves(command: Array) -> bool:
    """Whether a command moves in every part of a stretch, by more than noise."""
    least = min(float(part.std()) for part in np.array_split(command, _PARTS) if len(part))
    enough = max(_SHARE * float(command.std()), EXCITATION * white_noise(command))
    return float(np.ptp(command)) >= _RANGE and least > enough


def _crossings(command: Array) -> int:
    """Return how often a command goes from one side of its mean to the other."""
    off = command - command.mean()
    sides = np.sign(off[np.abs(off) > 0.5 * off.std()])
    return int(np.count_nonzero(np.diff(sides)))


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
