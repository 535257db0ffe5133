"""The time that nodes stamp with: never 1970, also before the first /clock."""

from __future__ import annotations

import time
from typing import Any


def begun(clock: Any) -> bool:
    """Return whether a node's clock says the time: with use_sim_time it is 0 until /clock does."""
    return bool(clock.now().nanoseconds)


def now_ns(clock: Any) -> int:
    """Return the time of a node's clock [ns], the computer's before the first /clock."""
    return int(clock.now().nanoseconds) or time.time_ns()
