"""Blocks to sliding windows by running sample index; whatever breaks a window restarts it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from actuator_glue.clock_check import LEAST_SECONDS, RateWatch, disagreement
from actuator_glue.errors import InputError
from actuator_glue.online.settings import EstimatorSettings
from actuator_glue.online.stream import (
    Event,
    Reason,
    Rejected,
    Restarted,
    Window,
)
from actuator_glue.records import Array, Record, same_period
from actuator_glue.sample_block import Block, check_block
from actuator_glue.setups import Setups, StreamSetup

# Longest stretch over which stamps are compared with index and period [s].
_RATE_SECONDS = 3.0
# Samples of so long show whether channels can be what they are said to be [s]; one of noise of
# 0.2 to 8 Hz showed it in 2 s, and slower motion needs more.
_STRETCH_SECONDS = 5.0


class WrongRateError(InputError):
    """Stamps tell another sample rate than the period of the samples."""


@dataclass(frozen=True, slots=True)
class WrongRate(Rejected):
    """Samples that were not used because their stamps tell another sample rate."""


@dataclass(slots=True)
class Tally:
    """Counts since the start, for diagnostics."""

    samples: int = 0
    blocks: int = 0
    lost: int = 0
    gaps: int = 0
    restarts: int = 0
    rejected: int = 0
    windows: int = 0


class Tail:
    """The last `keep` samples, in memory that does not grow; a force that is not there is NaN."""

    def __init__(self, keep: int) -> None:
        self.keep = keep
        self._data = np.empty((3, 2 * keep))
        self._stop = 0
        self._count = 0

    def __len__(self) -> int:
        return self._count

    def clear(self) -> None:
        """Forget all samples."""
        self._stop = self._count = 0

    def append(self, block: Block) -> None:
        """Append samples; at most `keep` at once."""
        n = len(block)
        if self._stop + n > self._data.shape[1]:
            kept = min(self._count, self.keep)
            self._data[:, :kept] = self._data[:, self._stop - kept : self._stop].copy()
            self._stop = kept
        here = self._data[:, self._stop : self._stop + n]
        here[0], here[1] = block.command, block.measured
        here[2] = np.nan if block.force is None else block.force
        self._stop += n
        self._count = min(self._count + n, self.keep)

    def last(self, n: int) -> tuple[Array, Array, Array]:
        """Return views of command, measured and force of the last n samples."""
        command, measured, force = self._data[:, self._stop - n : self._stop]
        return command, measured, force


class SlidingWindows:
    """Turns blocks into windows.

    Windows end where the running index is a multiple of the hop, so that whoever joins a stream
    late forms the same windows. A set-up holds from the sample it names. No clock is read: the
    same blocks and set-ups give the same windows, however they are cut into blocks.

    Args:
        settings: window, hop and clock tolerance are used.
    """

    def __init__(self, settings: EstimatorSettings) -> None:
        self.settings = settings
        self.tally = Tally()
        self.current: StreamSetup | None = None
        self._setups = Setups()
        self._tail: Tail | None = None
        self._window = self._hop = self._recent = self._stretch = 0
        self._next: int | None = None
        self._stamp_ns = 0
        self._last_stamp_ns = 0
        self._epoch = 0
        self._rate = 1.0
        self._watch = RateWatch(self._rate)

    @property
    def unused(self) -> str:
        """Why the samples that come now are part of no window; empty where they are, or none came.

        What is announced for later samples, or has passed, says nothing of those.
        """
        if self._next is None:
            return ''
        if self.current is None:
            if announced := self._setups.announced:
                first = min(setup.index for setup in announced)
                return f'samples arrive, but the test set-up holds from sample {first} on only'
            return 'samples arrive, but nothing on test_setup yet'
        if self.current.stiffness is None:
            return f'the specimen stiffness of {self.current.actuator!r} is not known'
        return ''

    def setup(self, setup: StreamSetup) -> list[Event]:
        """Take a test set-up; it holds from the sample it names, at once where that is past."""
        return self._begin(setup) if self._setups.announce(setup, self._next) else []

    def push(self, block: Block) -> tuple[list[Event], list[Window]]:
        """Take one block as it came; return what happened and the windows it completes."""
        events: list[Event] = []
        try:
            check_block(block)
            if self._next is None:
                events += self._begin_all(self._setups.begun(block.index))
            self._check_period(block)
            self._check_rate(block)
        except InputError as error:
            self.tally.rejected += 1
            kind = WrongRate if isinstance(error, WrongRateError) else Rejected
            events.append(kind(str(error)))
            if len(block.command) and self._tail is not None and len(self._tail):
                events.append(self._restart(block.index, 'bad-input', str(error)))
            self._step_over(block)
            return events, []
        events += self._follow(block)
        following, self._next = self._next, block.index
        windows: list[Window] = []
        for part, begun in self._setups.parts(block.index, len(block), following):
            events += self._begin_all(begun)
            self._append(block.part(part.start, part.stop), windows)
        self.tally.samples += len(block)
        self.tally.blocks += 1
        self._next = block.index + len(block)
        self._last_stamp_ns = block.stamp_ns
        self._stamp_ns = block.stamp_ns + round(len(block) * block.period * 1e9)
        return events, windows

    def _step_over(self, block: Block) -> None:
        """Count an unusable block's samples as seen, so that no gap is reported as well."""
        if block.index == self._next:
            count = max(len(block.command), len(block.measured))
            known = self.current.period if self.current is not None else 0.0
            self._next += count
            self._stamp_ns += round(count * known * 1e9)

    def _begin_all(self, setups: list[StreamSetup]) -> list[Event]:
        return [event for setup in setups for event in self._begin(setup)]

    def _check_period(self, block: Block) -> None:
        """Compare a block's period with the set-ups that will govern its samples.

        Raises:
            InputError: one of them says another rate.
        """
        for ahead in self._setups.ahead(block.index, len(block), self._next):
            setup = ahead or self.current
            if setup is not None and not same_period(block.period, setup.period):
                raise InputError(
                    f'block at sample {block.index}: period {block.period:g} s, but the test '
                    f'set-up says {1.0 / setup.period:g} Hz; publish a set-up with the rate of '
                    'the samples'
                )

    def _check_rate(self, block: Block) -> None:
        """Compare stamps with index and period: a factor of two would look like a slow actuator.

        Raises:
            WrongRateError: the stamps of the last seconds show another rate.
        """
        rate = 1.0 / block.period
        if not same_period(rate, self._rate):
            self._rate = rate
            # Decided before the first window, if that is long enough for a clock's precision.
            seconds = max(LEAST_SECONDS, min(0.75 * self.settings.window, _RATE_SECONDS))
            self._watch = RateWatch(rate, seconds=seconds)
        elif self._next is not None and block.index < self._next:
            self._watch.begin()
        self._watch.push(block.index, block.stamp_ns * 1e-9)
        if self._watch.found is not None:
            told = disagreement(rate, {'the stamps of the samples': self._watch.found})
            raise WrongRateError(
                f'{told}; nothing is estimated until both agree: mend the rate of whoever '
                'publishes the samples'
            )

    def _follow(self, block: Block) -> list[Event]:
        """Compare a block's index and stamp with those expected; a mismatch restarts windows."""
        if self._next is None:
            return []
        if block.index < self._next:
            message = (
                f'sample index went back from {self._next} to {block.index}: the stream began '
                'again, or two publishers share the topic'
            )
            return [self._restart(block.index, 'stream', message)]
        if block.index > self._next:
            lost = block.index - self._next
            self.tally.gaps += 1
            self.tally.lost += lost
            message = f'{lost} samples are missing before sample {block.index}'
            return [self._restart(block.index, 'gap', message)]
        step = (block.stamp_ns - self._stamp_ns) * 1e-9
        back = block.stamp_ns <= self._last_stamp_ns
        if back or abs(step) > self.settings.clock_tolerance:
            message = f'the clock jumped by {step:+.3f} s at sample {block.index}'
            return [self._restart(block.index, 'clock', message)]
        return []

    def _restart(self, index: int, reason: Reason, message: str) -> Restarted:
        if self._tail is not None:
            self._tail.clear()
        self.tally.restarts += 1
        return Restarted(index, reason, f'window restarted: {message}')

    def _begin(self, setup: StreamSetup) -> list[Event]:
        before, self.current = self.current, setup
        if before is not None and setup.same_test(before):
            return []
        if before is None or setup.actuator != before.actuator:
            self._epoch += 1
        if before is None or self._tail is None or not same_period(setup.period, before.period):
            self._window = max(2, round(self.settings.window / setup.period))
            self._hop = max(1, round(self.settings.hop / setup.period))
            self._recent = max(self._window, 2 * self._hop)
            stretch = max(2.0, _STRETCH_SECONDS / setup.period)
            self._stretch = self._hop * math.ceil(stretch / self._hop)
            self._tail = Tail(max(self._recent, self._stretch))
        index = setup.index if self._next is None else max(setup.index, self._next)
        known = 'unknown' if setup.stiffness is None else f'{setup.stiffness:g} N/m'
        message = (
            f'test set-up of {setup.actuator!r}: specimen stiffness {known}, '
            f'{1.0 / setup.period:g} Hz, hold {setup.hold}'
        )
        return [self._restart(index, 'setup', message)]

    def _append(self, block: Block, windows: list[Window]) -> None:
        setup, tail = self.current, self._tail
        if setup is None or tail is None:
            return
        start = 0
        while start < len(block):
            here = block.index + start
            stop = min(len(block), start + self._hop - here % self._hop)
            tail.append(block.part(start, stop))
            end = block.index + stop
            full = end % self._hop == 0 and len(tail) >= self._window
            if full and setup.stiffness is not None:
                windows.append(self._cut(block, stop, setup, tail))
            start = stop

    def _cut(self, block: Block, stop: int, setup: StreamSetup, tail: Tail) -> Window:
        """Return the window that ends with the sample before `stop` of a block."""

        def last(count: int, *, pushed: bool = False) -> Record:
            command, measured, force = tail.last(count)
            return Record(
                command=command,
                measured=measured,
                force=force if pushed and not np.isnan(force).any() else None,
                period=setup.period,
                stiffness=setup.stiffness,
                start_ns=block.stamp_ns + round((stop - count) * block.period * 1e9),
                first_index=block.index + stop - count,
                hold=setup.hold,
                actuator=setup.actuator,
                motion=setup.motion,
            )

        record = last(self._window)
        reach = min(len(tail), self._recent)
        recent = record if reach == self._window else last(reach)
        whole = (block.index + stop) % self._stretch == 0 and len(tail) >= self._stretch
        stretch = last(self._stretch, pushed=True) if whole else None
        number = self.tally.windows
        self.tally.windows += 1
        return Window(number, record, self._epoch, self.tally.restarts, recent, stretch)
