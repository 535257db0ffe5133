"""Which test set-up governs which samples of a stream."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.motion import METRES
from actuator_glue.records import Hold, check_motion, check_stiffness, same_period

MAX_INDEX = 2**62
# Stiffness in a message that leaves it unfilled [N/m]: a message's default can be any number but
# NaN, and 0 would be a free actuator.
UNFILLED = -1.0
# Nobody streams into a thousand announced set-ups; a publisher gone wild must not fill memory.
_MOST = 1000


@dataclass(frozen=True, slots=True)
class StreamSetup:
    """What must be known of a test to use its samples.

    Attributes:
        stiffness: specimen stiffness k [N/m]; None where it is not known.
        period: sample period [s].
        actuator: name of the actuator.
        hold: how the command runs between its samples.
        index: running index of the first sample it holds for.
        source: plant or file, for people.
        motion: what command and measured are, as in `Record`.

    Raises:
        InputError: negative stiffness, absurd period, unknown hold or motion, or a stiffness of
            what does not move in metres.
    """

    stiffness: float | None
    period: float
    actuator: str = 'actuator'
    hold: Hold = 'zoh'
    index: int = 0
    source: str = ''
    motion: str = METRES

    def __post_init__(self) -> None:
        where = f'test set-up of {self.actuator!r}'
        if self.stiffness is not None:
            object.__setattr__(self, 'stiffness', check_stiffness(self.stiffness, where))
        check_motion(self.motion, self.stiffness, where)
        if not (np.isfinite(self.period) and 1e-6 <= self.period <= 10.0):
            raise InputError(f'{where}: sample period {self.period:g} s is outside [1e-6, 10] s')
        if self.hold not in ('zoh', 'linear'):
            raise InputError(f"{where}: hold {self.hold!r} is unknown; use 'zoh' or 'linear'")
        if not 0 <= self.index <= MAX_INDEX:
            raise InputError(f'{where}: the running index {self.index} is outside [0, 2^62]')

    def same_test(self, other: StreamSetup) -> bool:
        """Whether samples under both set-ups may be fitted together."""
        return same_period(self.period, other.period) and (
            self.stiffness,
            self.actuator,
            self.hold,
            self.motion,
        ) == (other.stiffness, other.actuator, other.hold, other.motion)


def known_stiffness(value: float) -> float | None:
    """Return a stiffness of a message [N/m], None where it is not known: NaN or `UNFILLED`."""
    return None if np.isnan(value) or value == UNFILLED else float(value)


def from_message(message: Any) -> StreamSetup:
    """Return the set-up of a TestSetup.

    Raises:
        InputError: negative stiffness, absurd rate, unknown hold or motion.
    """
    rate = float(message.rate)
    name = str(message.actuator or message.header.frame_id)
    if not (np.isfinite(rate) and rate > 0.0):
        raise InputError(f'test set-up of {name!r}: rate {rate:g} Hz is not positive')
    return StreamSetup(
        stiffness=known_stiffness(message.specimen_stiffness),
        period=1.0 / rate,
        actuator=name,
        hold=message.hold,
        index=int(message.index),
        source=str(message.source),
        motion=str(message.motion) or METRES,
    )


class Setups:
    """The set-ups of one stream as they come: each holds from the sample it names.

    One that names a sample that has passed holds at once; of two that name the same sample the
    later one holds. Where the stream begins again, those that came since its last block, or just
    before it, are of the new numbering if one of them names the first sample or one before: each
    holds anew from the sample it names. All others are forgotten, as their numbers were the old
    ones.
    """

    def __init__(self) -> None:
        self._announced: list[StreamSetup] = []
        # What came lately, and the running index that followed then: may be of a new numbering.
        # Topics have no order among each other, so the last block may come after it.
        self._lately: list[tuple[int, StreamSetup]] = []

    @property
    def announced(self) -> tuple[StreamSetup, ...]:
        """Those that hold from a sample on that has not come yet, in the order of the samples."""
        return tuple(self._announced)

    def announce(self, setup: StreamSetup, following: int | None) -> bool:
        """Take a set-up; return whether it holds at once.

        Args:
            setup: what has come.
            following: running index of the sample after the last one; None before the first.
        """
        if following is not None:
            self._lately.append((following, setup))
            del self._lately[:-_MOST]
            if setup.index <= following:
                return True
        self._announced = _in_order([*self._announced, setup])
        return False

    def parts(
        self, index: int, count: int, following: int | None
    ) -> Iterator[tuple[slice, list[StreamSetup]]]:
        """Yield the parts of `count` samples from `index` on, and what begins with each.

        Args:
            index: running index of the first of them; where it went back the stream begins again.
            count: how many.
            following: as for `announce`.
        """
        if following is not None and index < following:
            again = _in_order([setup for _, setup in self._lately])
            self._announced = again if again and again[0].index <= index else []
            self._lately.clear()
        self._lately = [(said, setup) for said, setup in self._lately if said >= index]
        start = 0
        while start < count:
            begun = self.begun(index + start)
            stop = min([count, *(s.index - index for s in self._announced[:1])])
            yield slice(start, stop), begun
            start = stop

    def ahead(self, index: int, count: int, following: int | None) -> list[StreamSetup | None]:
        """Return what will govern each of those `parts`, None where what governs now goes on."""
        looking = Setups()
        looking._announced, looking._lately = [*self._announced], [*self._lately]
        parts = looking.parts(index, count, following)
        return [begun[-1] if begun else None for _, begun in parts]

    def begun(self, index: int) -> list[StreamSetup]:
        """Return, once, the announced set-ups that hold at a sample, the last one governs it."""
        count = sum(s.index <= index for s in self._announced)
        begun, self._announced = self._announced[:count], self._announced[count:]
        return begun


def _in_order(setups: list[StreamSetup]) -> list[StreamSetup]:
    """Return set-ups by the sample they name, the last one of each, no more than are kept."""
    by_index = {setup.index: setup for setup in setups}
    return [by_index[index] for index in sorted(by_index)][:_MOST]
