"""rclpy's executor, without its repeated work for events that hardly ever come."""

from __future__ import annotations

import time
from typing import Any

from rclpy.event_handler import EventHandler
from rclpy.executors import SingleThreadedExecutor

# Seconds between two looks at events of the middleware, such as a partner's incompatible QoS.
_EVENTS = 1.0


class Executor(SingleThreadedExecutor):
    """Waits for events of the middleware now and then, for all else always.

    There are two per publisher and subscription. Adding them to the wait set takes longer than
    carrying a block of samples, and rclpy does so for every block.
    """

    def __init__(self) -> None:
        super().__init__()
        self._due = 0.0
        self._looked = False

    def spin_once(self, *args: Any, **options: Any) -> None:
        """Do what is ready, or what is next, as rclpy does."""
        if self._looked:
            self._due, self._looked = time.monotonic() + _EVENTS, False
        super().spin_once(*args, **options)

    def can_execute(self, entity: Any) -> bool:
        """Return whether to wait for an entity."""
        if isinstance(entity, EventHandler):
            if time.monotonic() < self._due:
                return False
            self._looked = True
        return bool(super().can_execute(entity))
