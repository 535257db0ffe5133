"""What happened in a test and when: alarms of the nodes, diagnoses, other explanations."""

from __future__ import annotations

from bisect import insort
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from operator import attrgetter
from typing import Any

_MOST = 500  # entries that are kept
_LONGEST = 500  # characters of a text
_KINDS = 1000  # alarms of a node whose counts are remembered
_COUNT, _LAST = ' (count)', ' (last)'
REMEMBERED = (
    10.0  # s, for which a node shows a fault after it: what comes again by then has lasted
)


@dataclass(slots=True)
class Entry:
    """One thing that happened.

    Attributes:
        place: at which it was known.
        level: 0 for news, 1 for a warning, 2 for an error.
        of: whose it is: a node, or what is told.
        text: for people, as it was said first.
        last: place at which it was said last.
    """

    place: int
    level: int
    of: str
    text: str
    last: int


class Logbook:
    """Entries in the order of their places; the newest replace the oldest.

    Attributes:
        version: counts what was added.
    """

    def __init__(self) -> None:
        self.version = 0
        self._entries: deque[Entry] = deque()
        self._lasting: dict[tuple[str, str], Entry] = {}
        self._counts: dict[tuple[str, str], int] = {}

    def clear(self) -> None:
        """Let go of entries; what nodes have counted so far stays known."""
        self.version += 1
        self._entries.clear()
        self._lasting.clear()

    def news(self, place: int, of: str, text: str) -> None:
        """Take something that is no alarm."""
        self._add(Entry(place, 0, of, text[:_LONGEST], place))

    def alarm(
        self, place: int, remembered: int, of: str, kind: str, level: int, text: str
    ) -> None:
        """Take an alarm that stands at a place; said again soon after, it is the same one.

        Args:
            place: at which it was said.
            remembered: places after which it is another one.
            of: whose it is.
            kind: what it is; the text of one kind may differ.
            level: 1 or 2.
            text: for people.
        """
        last = self._lasting.get((of, kind))
        if last is not None and last.level >= level and 0 <= place - last.last <= remembered:
            last.last = place
            self.version += 1
            return
        made = Entry(place, level, of, text[:_LONGEST], place)
        self._lasting[of, kind] = made
        self._add(made)

    def health(
        self,
        place: int,
        remembered: int,
        of: str,
        level: int,
        message: str,
        values: Mapping[str, str],
    ) -> None:
        """Take what a node says of itself: its faults one by one, where it counts them.

        Args:
            place: at which it was said.
            remembered: places for which a node shows a fault.
            of: its name.
            level: 0 to 3, of the worst fault.
            message: that fault's.
            values: keys with what it shows; a fault has `KIND (count)` and `KIND (last)`.
        """
        counted = {k.removesuffix(_COUNT): n for k, n in values.items() if k.endswith(_COUNT)}
        shown = False
        for kind, number in counted.items():
            text = values.get(kind + _LAST, kind)
            worst = level > 0 and text == message
            shown |= worst
            count = int(number) if number.isdecimal() else 0
            # Of a node that is heard for the first time, only what it shows now happened now.
            unheard = 0 if worst or (of, '') in self._counts else count
            before = self._counts.get((of, kind), unheard)
            if len(self._counts) < _KINDS:
                self._counts[of, kind] = count
            if count != before and count:
                self.alarm(place, remembered, of, kind, min(level, 2) if worst else 1, text)
        if len(self._counts) < _KINDS:
            self._counts[of, ''] = 0
        if level > 0 and not shown:
            self.alarm(place, remembered, of, '', min(level, 2), message)

    def counted(self, place: int, period: float) -> tuple[int, int]:
        """Return how many entries were known at a place, and how many of them last there."""
        known = [entry for entry in self._entries if entry.place <= place]
        return len(known), sum(self._lasts(entry, place, period) for entry in known)

    def told(self, place: int, period: float, most: int) -> list[dict[str, Any]]:
        """Return the newest entries that were known at a place, for JSON; the newest first.

        Args:
            place: at which that is asked.
            period: from one place to the next [s].
            most: entries that are told, beside those that last.

        Returns:
            Of each `start` and `stop` [s], when an alarm was said first and last; `stop` is None
            for one that lasts.
        """
        known = [entry for entry in self._entries if entry.place <= place]
        older = [one for one in known[:-most] if self._lasts(one, place, period)]
        return [
            {
                'start': entry.place * period,
                'stop': None if self._lasts(entry, place, period) else entry.last * period,
                'level': entry.level,
                'of': entry.of,
                'text': entry.text,
            }
            for entry in reversed(older + known[-most:])
        ]

    @staticmethod
    def _lasts(entry: Entry, place: int, period: float) -> bool:
        remembered = REMEMBERED / period if period else 0.0
        return entry.level > 0 and place <= entry.last + remembered

    def _add(self, made: Entry) -> None:
        self.version += 1
        if len(self._entries) == _MOST:
            self._entries.popleft()
        # Before what became known later, though it came before.
        insort(self._entries, made, key=attrgetter('place'))
