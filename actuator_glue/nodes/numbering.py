"""What the numbers of arriving messages tell: lost ones, and publishers that take turns."""

from __future__ import annotations

import time
from collections import Counter, deque
from typing import Any

from actuator_glue.nodes import partners

# A node that is started again takes over once or, with what was on its way, twice; nobody takes
# turns so often within so long [s].
_SURE, _WITHIN = 3, 10.0
# Publishers whose numbers may go on.
_OPEN = 8


class Numbering:
    """Watches what arrives at a subscription: each publisher numbers its messages.

    Where two send in turn, the numbers of the one go on after those of the other. That two are
    known says nothing: one may be inactive, or was killed and is still known.

    Attributes:
        lost: messages that were sent and did not arrive, since the first that did.
    """

    def __init__(self) -> None:
        self.lost = 0
        # The last number of each publisher, of whom sent last at the end.
        self._last: list[int] = []
        self._jump = 0, 0
        self._turns: deque[float] = deque(maxlen=_SURE)

    def take(self, info: Any) -> None:
        """Take what the middleware knows of a message; some number none."""
        number = info.get('publication_sequence_number')
        if number is None:
            return
        left, reached = self._jump
        if left < number < reached:
            # What seemed lost comes: the jump was to the numbers of another publisher.
            self.lost -= reached - left - 1
            self._last.insert(0, left)
        self._jump = 0, 0
        before = max((n for n in self._last if n < number), default=None)
        if before is not None:
            self.lost += number - before - 1
            if number > before + 1:
                self._jump = before, number
            if self._last[-1] != before:
                self._turns.append(time.monotonic())
            self._last.remove(before)
        self._last = [*self._last[1 - _OPEN :], number]

    def in_turn(self, node: Any, topic: str) -> str:
        """Return who sends in turn and what to do; empty where one does."""
        recent = len(self._turns) == _SURE and time.monotonic() - self._turns[0] < _WITHIN
        found = node.get_publishers_info_by_topic(topic) if recent else []
        if len(found) < 2:
            return ''
        names = Counter(partners.name(info) for info in found)
        who = ', '.join(f'{n} ({count} times)' if count > 1 else n for n, count in names.items())
        return (
            f'{len(found)} publishers share {topic}: {who}; what is made of it is unusable while '
            'they send in turn: end all but one, or give each a namespace of its own'
        )
