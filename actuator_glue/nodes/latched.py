"""Latched messages: which of those sent before a subscription was made still count."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from actuator_glue.nodes.base import SuiteNode
from actuator_glue.nodes.topics import Topic

# The old messages of a publisher arrive together, once it is met [s].
_TOGETHER = 0.1


class Latched:
    """A subscription whose callback gets what was sent before it was made in order of sending.

    Args:
        node: subscribes, until its deactivation; reports what the callback raises.
        topic: a latched topic; a publisher sends its last few messages to late subscribers.
        callback: gets a message.
        counts: whether the first of two old messages counts beside the second, which was sent
            later.
    """

    def __init__(
        self,
        node: SuiteNode,
        topic: Topic,
        callback: Callable[[Any], None],
        counts: Callable[[Any, Any], bool],
    ) -> None:
        # One that is refused costs neither those after it nor the sample that waits for them.
        self._callback = node.guarded(callback)
        self._node = node
        self._counts = counts
        self._waiting: list[tuple[float, Any]] = []
        self._sent = self._arrived = 0.0
        self._began = time.time()
        self._made = node.subscribe(topic, self._take, info=True)
        node.every(_TOGETHER, self._settle_in_time)

    def settle(self) -> None:
        """Hand over all that has come; call it with what needs the messages, e.g. a sample."""
        for message, info in self._node.arrived(self._made):
            self._take(message, info)
        self._hand_over()

    def _hand_over(self) -> None:
        """Hand over the old messages that wait, in order of sending."""
        old, self._waiting = sorted(self._waiting, key=lambda one: one[0]), []
        for i, (sent, message) in enumerate(old):
            self._sent = sent
            if all(self._counts(message, later) for _, later in old[i + 1 :]):
                self._callback(message)

    def _take(self, message: Any, info: Any) -> None:
        sent = 1e-9 * info['source_timestamp']
        if sent >= self._began:
            self._hand_over()
            self._callback(message)
        elif sent >= self._sent:  # of the last one that was handed over
            self._waiting.append((sent, message))
            self._arrived = time.monotonic()

    def _settle_in_time(self) -> None:
        if time.monotonic() - self._arrived >= _TOGETHER:
            self._hand_over()


def newest(before: Any, after: Any) -> bool:
    """Of old messages only the one that was sent last counts."""
    del before, after
    return False


def of_one_numbering(before: Any, after: Any) -> bool:
    """Whether a TestSetup counts beside one that was sent later.

    Each holds from the sample it names. Where the later one names the same sample it holds
    instead; where it names an earlier sample of a later time, the stream has begun again, and the
    numbers of the first one are those of the old stream.
    """
    if before.index <= after.index:
        return bool(before.index < after.index)
    stamps = [(m.header.stamp.sec, m.header.stamp.nanosec) for m in (before, after)]
    return stamps[0] >= stamps[1]
