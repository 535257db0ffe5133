"""Sequence numbers: which samples are missing, duplicate or late; none is invented."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from actuator_glue.records import Array

# How long a sample waits for those that ought to come before it.
HOLD_SAMPLES = 256
HOLD_SECONDS = 0.05
# A counter further off than this is no loss, and no late sample, but another numbering [s].
AHEAD_SECONDS = 1.0
BEHIND_SECONDS = 0.1
# Samples in a row by which another numbering is believed.
BELIEVED = 5
# Newest numbers of which it is known whether they were lost: it tells a late sample from a
# repeated one.
_REMEMBERED = 4096
_NONE = np.iinfo(np.int64).min


@dataclass(frozen=True, slots=True, eq=False)
class Run:
    """Samples without a gap.

    Attributes:
        index: running index of the first.
        rows: values of each, shape (n, columns).
        began: a new numbering begins with them.
    """

    index: int
    rows: Array
    began: bool


class Sequence:
    """Puts samples in order by their counter; memory is bounded whatever comes.

    Args:
        rate: sample rate [Hz].
        modulus: where the counter begins again by its type; None where it does not.
        restarts: whether the sender may begin to count anew. Where messages are signed it may
            not: a recorded one sent again must not be taken for a new beginning.
        shuffled: whether samples may come out of order: the first ones then wait a moment for
            those that ought to come before them.
        counts: gets lost, duplicates, reordered, late, implausible, restarts.
    """

    def __init__(
        self,
        rate: float,
        modulus: int | None,
        *,
        restarts: bool,
        counts: Counter[str],
        shuffled: bool = True,
    ) -> None:
        self._rate = rate
        self._modulus = modulus
        self._restarts = restarts
        self._shuffled = shuffled
        self.counts = counts
        self._next: int | None = None
        self._base = 0
        self._accepted = 0.0
        # The first samples, as they came: when, their number, their values.
        self._opening: list[tuple[float, int, Array]] = []
        # In the order in which they came, with the time of that.
        self._held: dict[int, tuple[float, Array]] = {}
        self._highest = 0
        # Each lost index at its remainder, so that memory is the same after any losses.
        self._lost = np.full(_REMEMBERED, _NONE, dtype=np.int64)
        self._candidates: list[tuple[int, Array]] = []

    def push(self, counter: NDArray[np.int64], rows: Array, now: float) -> list[Run]:
        """Take samples as they came; return those that are in order by now.

        Args:
            counter: number of each, shape (n,).
            rows: values of each, shape (n, columns).
            now: monotonic time [s].
        """
        if self._in_order(counter):
            assert self._next is not None
            run = Run(self._next - self._base, rows, False)
            self._advance(len(rows), now)
            return [run]
        out = _Out()
        for number, row in zip(counter.tolist(), rows, strict=True):
            self._take(number, row, now, out)
        self._give_up(now, out)
        return out.runs()

    def waited(self, now: float) -> list[Run]:
        """Return what has waited long enough for samples that did not come."""
        if not self._held and not self._opening:
            return []
        out = _Out()
        self._give_up(now, out)
        return out.runs()

    def skip(self, samples: int, now: float) -> list[Run]:
        """Step over samples of which only the time they took is known."""
        out = _Out()
        self._open(out)
        while self._held:
            self._jump(now, out)
        if self._next is not None:
            self._advance(samples, now)
        return out.runs()

    def _in_order(self, counter: NDArray[np.int64]) -> bool:
        if self._next is None or self._held or self._candidates or not len(counter):
            return False
        first, last = int(counter[0]), int(counter[-1])
        if self._modulus is not None and last - first != len(counter) - 1:
            return False
        if self._wrapped(first) != self._next:
            return False
        return len(counter) == 1 or bool((np.diff(counter) == 1).all())

    def _wrapped(self, number: int) -> int:
        """Return the whole number nearest to the newest that the counter may stand for."""
        if self._modulus is None or (self._next is None and not self._opening):
            return number
        half, newest = self._modulus // 2, self._highest + 1
        return newest + (number - newest + half) % self._modulus - half

    def _advance(self, samples: int, now: float) -> None:
        assert self._next is not None
        self._next += samples
        self._highest = max(self._highest, self._next - 1)
        self._accepted = now

    def _take(self, number: int, row: Array, now: float, out: _Out) -> None:
        if self._next is None and self._shuffled:
            self._wait(number, row, now, out)
            return
        if self._next is None:
            self._begin(number, [row], now, out)
            return
        number = self._wrapped(number)
        step = number - self._next
        ahead = self._rate * (AHEAD_SECONDS + 2.0 * (now - self._accepted))
        if not -max(BEHIND_SECONDS * self._rate, 32.0) <= step <= ahead:
            self._doubt(number, row, now, out)
            return
        self._disbelieve()
        if step == 0:
            if number < self._highest:
                self.counts['reordered'] += 1
            out.put(self._next - self._base, row)
            self._advance(1, now)
            self._release(now, out)
        elif number in self._held or (step < 0 and self._was_taken(number)):
            self.counts['duplicates'] += 1
        elif step < 0:
            self.counts['late'] += 1
            if number >= self._base:
                self._lost[(number - self._base) % _REMEMBERED] = _NONE
        else:
            if number < self._highest:
                self.counts['reordered'] += 1
            self._highest = max(self._highest, number)
            self._held[number] = now, row
            if len(self._held) > HOLD_SAMPLES:
                self._jump(now, out)

    def _wait(self, number: int, row: Array, now: float, out: _Out) -> None:
        """Keep one of the first samples until those before it have had time to come."""
        if not self._opening:
            self._highest = number - 1
        number = self._wrapped(number)
        self._highest = max(self._highest, number)
        self._opening.append((now, number, row))
        if len(self._opening) >= _REMEMBERED:
            self._open(out)

    def _open(self, out: _Out) -> None:
        """Begin with the lowest number among the first samples, one far off them left out."""
        waited, self._opening = self._opening, []
        if not waited:
            return
        numbers = sorted(number for _, number, _ in waited)
        middle = numbers[len(numbers) // 2]
        near = middle - AHEAD_SECONDS * self._rate
        self._begin(next(n for n in numbers if n >= near), [], waited[0][0], out)
        for came, number, row in waited:
            self._take(number, row, came, out)

    def _was_taken(self, number: int) -> bool:
        index = number - self._base
        return index >= 0 and not bool(self._lost[index % _REMEMBERED] == index)

    def _release(self, now: float, out: _Out) -> None:
        """Hand out what waited for the sample before it."""
        assert self._next is not None
        while self._next in self._held:
            out.put(self._next - self._base, self._held.pop(self._next)[1])
            self._advance(1, now)

    def _give_up(self, now: float, out: _Out) -> None:
        if self._opening and now - self._opening[0][0] > HOLD_SECONDS:
            self._open(out)
        while self._held and now - next(iter(self._held.values()))[0] > HOLD_SECONDS:
            self._jump(now, out)

    def _jump(self, now: float, out: _Out) -> None:
        """Count samples missing before the first waiting one as lost, and go on with that."""
        assert self._next is not None
        first = min(self._held)
        self.counts['lost'] += first - self._next
        indices = np.arange(max(self._next, first - _REMEMBERED) - self._base, first - self._base)
        self._lost[indices % _REMEMBERED] = indices
        self._next = first
        self._release(now, out)

    def _doubt(self, number: int, row: Array, now: float, out: _Out) -> None:
        """Note a number far off; believe in a new numbering when some follow each other."""
        known = self._candidates
        if known and number != known[-1][0] + 1:
            self._disbelieve()
            known = self._candidates
        if not self._restarts:
            self.counts['implausible'] += 1
            return
        known.append((number, row))
        if len(known) < BELIEVED:
            return
        while self._held:
            self._jump(now, out)
        self.counts['restarts'] += 1
        self._candidates = []
        self._begin(known[0][0], [r for _, r in known], now, out)

    def _disbelieve(self) -> None:
        self.counts['implausible'] += len(self._candidates)
        self._candidates = []

    def _begin(self, number: int, rows: list[Array], now: float, out: _Out) -> None:
        self._next = self._base = number
        self._highest, self._accepted = number - 1, now
        self._lost.fill(_NONE)
        out.begin()
        for row in rows:
            out.put(self._next - self._base, row)
            self._advance(1, now)


class _Out:
    """Samples handed out one by one, as runs."""

    def __init__(self) -> None:
        self._parts: list[tuple[int, list[Array], bool]] = []
        self._began = False

    def begin(self) -> None:
        """Note that the samples which follow have a new numbering."""
        self._began = True

    def put(self, index: int, row: Array) -> None:
        """Hand out a sample."""
        last = self._parts[-1] if self._parts else None
        if last is None or self._began or last[0] + len(last[1]) != index:
            self._parts.append((index, [row], self._began))
            self._began = False
        else:
            last[1].append(row)

    def runs(self) -> list[Run]:
        """Return what was handed out."""
        return [Run(index, np.array(rows), began) for index, rows, began in self._parts]
