"""From what arrives to stamped samples in order: layout, sequence and clock put together."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal, TypeAlias

import numpy as np

from actuator_glue.clock_check import RateWatch, disagreement, rate_by_steps
from actuator_glue.errors import InputError
from actuator_glue.io.units import FLOAT32_COUNTS
from actuator_glue.records import Array
from actuator_glue.streams.clock import HELD_UP, STEP, ClockMap
from actuator_glue.streams.layout import TYPES, Layout, Rows
from actuator_glue.streams.sequence import Run, Sequence
from actuator_glue.streams.times import Jumps, NumbersByTime

# What tells the order of samples: a counter, else their times, else that they arrive in order.
Order: TypeAlias = Literal['counter', 'time', 'arrival']
# Arrivals bunch up: their rate is taken over stretches this long [s], and two of them.
_ARRIVAL_SECONDS, _ARRIVAL_STRETCHES = 5.0, 2
# Times whose steps are looked at together where they alone tell the order, and over how long [s].
_STEPS, _STEP_SECONDS = 2048, 3.0


@dataclass(frozen=True, slots=True, eq=False)
class Samples:
    """Consecutive samples with their place in the stream.

    Attributes:
        index: running index of the first.
        stamp_ns: when it was taken, by the receiver's clock [ns].
        command: shape (n,) [m].
        measured: shape (n,) [m].
        force: shape (n,) [N], or None.
        began: the sender began to count anew with them.
    """

    index: int
    stamp_ns: int
    command: Array
    measured: Array
    force: Array | None
    began: bool


class Reception:
    """State machine without clock, socket or ROS.

    Args:
        layout: what is received.
        rate: sample rate [Hz].
        in_order: whether the transport delivers everything, and in order.
        signed: whether messages are signed.

    Raises:
        InputError: signed messages that carry neither counter nor time.
    """

    def __init__(
        self, layout: Layout, rate: float, *, in_order: bool = False, signed: bool = False
    ) -> None:
        self.rate = rate
        self.counts: Counter[str] = Counter()
        self.clock = ClockMap()
        names = layout.fields
        self.order: Order = 'arrival'
        if 'counter' in names:
            self.order = 'counter'
        elif 'time' in names and not in_order:
            self.order = 'time'
        if signed and self.order == 'arrival':
            raise InputError(
                'key: the layout has neither counter nor time, so that a message recorded by '
                'somebody could be sent again; add a counter'
            )
        self._force = 'force' in names
        told_by = names.get(self.order)
        self._float32 = told_by is not None and TYPES[told_by.type] == 'f4'
        modulus = layout.modulus if self.order == 'counter' else None
        self._sequence = Sequence(
            rate, modulus, restarts=not signed, shuffled=not in_order, counts=self.counts
        )
        self._rates = _Rates(rate, layout, self.order)
        self._numbers = NumbersByTime()
        self._arrived = 0
        self._jumps = Jumps(rate)
        self._last_arrival = 0.0
        # Index and time of the newest sample that has a time: as it came, and as it was stamped.
        self._timed: tuple[int, float] | None = None
        self._clocked = 0, 0.0

    def warnings(self, modulus: int | None) -> list[str]:
        """Return warnings of faults that cannot be seen in such a stream."""
        if self.order == 'arrival':
            return ['the layout has neither counter nor time: lost samples cannot be seen']
        if self._float32:
            hours = FLOAT32_COUNTS / self.rate / 3600.0
            return [
                f'the {self.order} is a float32, which tells samples apart for {hours:.3g} h at '
                'most; what comes later is left out: send it as uint32, or as float64'
            ]
        if modulus is not None and modulus < 2.0 * self.rate:
            seconds = 0.5 * modulus / self.rate
            return [f'the counter is so small that gaps beyond {seconds:.3g} s are miscounted']
        return []

    @property
    def rate_fault(self) -> str:
        """Message if the sender's time or arrivals show another sample rate, else empty."""
        return self._rates.fault

    def push(self, rows: Rows, now: float) -> list[Samples]:
        """Take rows as they came.

        Args:
            rows: at least one sample, or a mark that a connection begins.
            now: monotonic time [s].
        """
        runs: list[Run] = []
        if rows.fresh:
            runs += self._interrupted(now)
        if len(rows.command):
            runs += self._ordered(rows, now)
            self._last_arrival = now
        out = self._stamped(runs, rows.arrival_ns)
        return out

    def waited(self, now: float, now_ns: int) -> list[Samples]:
        """Return what has waited long enough for samples that did not come."""
        return self._stamped(self._sequence.waited(now), now_ns)

    def _ordered(self, rows: Rows, now: float) -> list[Run]:
        size = len(rows.command)
        columns = np.empty((size, 4))
        columns[:, 0], columns[:, 1] = rows.command, rows.measured
        columns[:, 2] = 0.0 if rows.force is None else rows.force
        columns[:, 3] = np.nan if rows.time is None else rows.time
        if self.order == 'counter' and rows.counter is not None:
            return self._sequence.push(rows.counter, columns, now)
        if self.order == 'time' and rows.time is not None:
            self._rates.steps(rows.time)
            return self._sequence.push(self._numbers.of(rows.time * self.rate), columns, now)
        return self._arrive(rows.time, columns, now)

    def _arrive(self, time: Array | None, columns: Array, now: float) -> list[Run]:
        """Number samples as they come, with a gap where their times jump ahead."""
        runs: list[Run] = []
        start = 0
        gaps = [] if time is None else self._jumps.found(time)
        for stop, missing in [*gaps, (len(columns), 0)]:
            counter = np.arange(self._arrived, self._arrived + stop - start, dtype=np.int64)
            self._arrived += stop - start
            runs += self._sequence.push(counter, columns[start:stop], now)
            if missing:
                self.counts['lost'] += missing
                runs += self._step_over(missing, now)
            start = stop
        return runs

    def _interrupted(self, now: float) -> list[Run]:
        """A connection begins: how many samples went by is known only by a counter or the time."""
        self._jumps = Jumps(self.rate)
        if self.order != 'arrival' or not self._arrived:
            return []
        self.counts['interruptions'] += 1
        return self._step_over(max(1, round((now - self._last_arrival) * self.rate)), now)

    def _step_over(self, samples: int, now: float) -> list[Run]:
        self._arrived += samples
        return self._sequence.skip(samples, now)

    def _stamped(self, runs: list[Run], arrival_ns: int) -> list[Samples]:
        found = []
        parts = [part for run in runs for part in self._by_setting(run)]
        for place, (run, anew) in enumerate(parts):
            if run.began:
                self._rates.begin()
                self._clocked = 0, 0.0
            if anew:
                self.clock = ClockMap()
            final = run.index + len(run.rows) - 1
            first, _ = self._time(run.index, run.rows[0, 3])
            last, timed = self._time(final, run.rows[-1, 3])
            if place == len(parts) - 1:
                self.clock.update(last, arrival_ns)
                self._rates.push(final, last if timed else None, arrival_ns * 1e-9)
            elif anew:
                self.clock.update(first, arrival_ns)
            stamp = self.clock.stamp_ns(first, last)
            force = run.rows[:, 2] if self._force else None
            command, measured = run.rows[:, 0], run.rows[:, 1]
            found.append(Samples(run.index, stamp, command, measured, force, run.began))
        return found

    def _time(self, index: int, time: float) -> tuple[float, bool]:
        """Return a sample's time by the sender's clock [s], and whether it was sent.

        Where it was not, it follows from the last one that was; without any from the index.
        """
        if not np.isnan(time):
            self._clocked = index, float(time)
            return float(time), True
        at, known = self._clocked
        return known + (index - at) / self.rate, False

    def _by_setting(self, run: Run) -> list[tuple[Run, bool]]:
        """Part a run where the sender's clock was set while its counter went on.

        Returns:
            Parts, and whether the sender's clock is another one from each on.
        """
        if run.began:
            self._timed = None
        at = np.flatnonzero(~np.isnan(run.rows[:, 3]))
        if not len(at):
            return [(run, run.began)]
        index, times = (at + run.index).astype(np.float64), run.rows[at, 3]
        known = (index[0], times[0]) if self._timed is None else self._timed
        steps = np.diff(times, prepend=known[1])
        samples = np.diff(index, prepend=known[0]) / self.rate
        set_anew = (steps < -STEP) | (steps > HELD_UP + 1.5 * samples)
        self.counts['clock set'] += int(set_anew.sum())
        set_anew[0] |= self._timed is None  # what came before had no time
        self._timed = int(index[-1]), float(times[-1])
        cuts = sorted({0, *at[set_anew].tolist()})
        begins = {*at[set_anew].tolist(), *([0] if run.began else [])}
        return [
            (Run(run.index + a, run.rows[a:b], run.began and not a), a in begins)
            for a, b in pairwise([*cuts, len(run.rows)])
        ]


class _Rates:
    """Compares the declared rate of a stream with the sender's time and with arrivals."""

    def __init__(self, rate: float, layout: Layout, order: Order) -> None:
        self._rate = rate
        self._by_time = order == 'time'
        time = layout.fields.get('time')
        # In a packet with a single time the other times are computed by the declared rate.
        self._every = layout.samples if time in layout.packet else 1
        self._times: list[float] = []
        self._found: float | None = None
        self._sender = RateWatch(rate)
        self._arrival = RateWatch(rate, seconds=_ARRIVAL_SECONDS, patience=_ARRIVAL_STRETCHES)

    @property
    def fault(self) -> str:
        clocks = {
            "the sender's time": self._found if self._by_time else self._sender.found,
            'the arrival of the samples': self._arrival.found,
        }
        odd = {name: rate for name, rate in clocks.items() if rate is not None}
        return disagreement(self._rate, odd) if odd else ''

    def begin(self) -> None:
        self._sender.begin()
        self._arrival.begin()

    def push(self, index: int, sender: float | None, arrival: float) -> None:
        if sender is not None and not self._by_time:
            self._sender.push(index, sender)
        self._arrival.push(index, arrival)

    def steps(self, times: Array) -> None:
        """Take times that tell the order: their rounded numbers agree with any rate."""
        self._times += times[:: self._every].tolist()
        long = len(self._times) > 64 and self._times[-1] - self._times[0] > _STEP_SECONDS
        if long or len(self._times) >= _STEPS:
            found = rate_by_steps(self._times, self._rate / self._every)
            self._found = None if found is None else found * self._every
            self._times.clear()
