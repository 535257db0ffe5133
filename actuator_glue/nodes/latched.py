"""Latched messages: of those sent before a subscription was made, the last one counts."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from actuator_glue.nodes.base import SuiteNode
from actuator_glue.nodes.topics import Topic

# The old messages of a publisher arrive together, once it is met [s].
_TOGETHER = 0.1


class Newest:
    """A subscription whose callback gets, of what was sent before it was made, the newest only.

    Args:
        node: subscribes, until its deactivation.
        topic: a latched topic; a publisher sends its last few messages to late subscribers.
        callback: gets a message.
    """

    def __init__(self, node: SuiteNode, topic: Topic, callback: Callable[[Any], None]) -> None:
        self._callback = callback
        self._waiting: Any = None
        self._sent = self._arrived = 0.0
        self._began = time.time()
        node.subscribe(topic, self._take, info=True)
        node.every(_TOGETHER, self._settle_in_time)

    def settle(self) -> None:
        """Hand over what waits; call it with whatever needs the message, e.g. a sample."""
        message, self._waiting = self._waiting, None
        if message is not None:
            self._callback(message)

    def _take(self, message: Any, info: Any) -> None:
        sent = 1e-9 * info['source_timestamp']
        if sent >= self._began:
            self.settle()
            self._callback(message)
        elif sent >= self._sent:
            self._waiting, self._sent, self._arrived = message, sent, time.monotonic()

    def _settle_in_time(self) -> None:
        if time.monotonic() - self._arrived >= _TOGETHER:
            self.settle()
