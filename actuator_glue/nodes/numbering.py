"""Whether several nodes publish one topic in turn, told by the numbers of what they send."""

from __future__ import annotations

import time
from collections import Counter, deque
from typing import Any

from actuator_glue.nodes import partners

# A node that is started again counts from 1 again, once; so often within so long [s] none does.
_SURE, _WITHIN = 3, 10.0


class InTurn:
    """Watches what arrives at a subscription.

    Each publisher numbers its messages: where two send in turn, the numbers go back again and
    again. That two are known says nothing: one may be inactive, or was killed and is still known.
    """

    def __init__(self) -> None:
        self._last = 0
        self._back: deque[float] = deque(maxlen=_SURE)

    def take(self, info: Any) -> None:
        """Take what the middleware knows of a message; some number none."""
        number = info.get('publication_sequence_number')
        if number is None:
            return
        if number <= self._last:
            self._back.append(time.monotonic())
        self._last = number

    def told(self, node: Any, topic: str) -> str:
        """Return who sends in turn and what to do; empty where one does."""
        recent = len(self._back) == _SURE and time.monotonic() - self._back[0] < _WITHIN
        found = node.get_publishers_info_by_topic(topic) if recent else []
        if len(found) < 2:
            return ''
        names = Counter(partners.name(info) for info in found)
        who = ', '.join(f'{n} ({count} times)' if count > 1 else n for n, count in names.items())
        return (
            f'{len(found)} publishers share {topic}: {who}; what is made of it is unusable while '
            'they send in turn: end all but one, or give each a namespace of its own'
        )
