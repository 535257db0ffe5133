"""What a node says about itself on /diagnostics."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

OK, WARN, ERROR = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR

# A fault stays visible this long after its last occurrence, so that people see it.
REMEMBER = 10.0  # s
# A fault that comes again within this time has lasted [s]; reports are up to a second apart.
LASTING = 1.5
# A stream of a thousand bad blocks a second must not fill the log; /diagnostics counts them all.
LOGGED_PER_SECOND = 5


@dataclass(slots=True)
class Rate:
    """Events per second over the last reports."""

    count: int = 0
    _marks: deque[tuple[float, int]] = field(default_factory=lambda: deque(maxlen=6))

    def add(self, n: int = 1) -> None:
        """Count n events."""
        self.count += n

    def per_second(self, now: float) -> float:
        """Return the rate since a few calls ago; `now` is a monotonic time [s]."""
        self._marks.append((now, self.count))
        first, seen = self._marks[0]
        return (self.count - seen) / (now - first) if now > first else 0.0


class Health:
    """Faults with their last message, and values to show.

    Args:
        name: name of the node, fully qualified.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._faults: dict[str, tuple[int, str, float, int]] = {}
        self._logged: dict[str, deque[float]] = {}
        self.values: dict[str, Any] = {}

    def fault(self, kind: str, message: str, now: float, level: Any = WARN) -> bool:
        """Note a fault; return whether to log it: one that lasts only once, few in all."""
        before = self._faults.get(kind)
        self._faults[kind] = (level, message, now, 1 + (before[3] if before else 0))
        if before is not None and before[1] == message and now - before[2] <= LASTING:
            return False
        recent = self._logged.setdefault(kind, deque(maxlen=LOGGED_PER_SECOND))
        if len(recent) == LOGGED_PER_SECOND and now - recent[0] < 1.0:
            return False
        recent.append(now)
        return True

    def message(self, now: float, stamp: Any, state: str) -> DiagnosticArray:
        """Return the DiagnosticArray to publish.

        Args:
            now: monotonic time [s].
            stamp: time of the node's clock for the header.
            state: lifecycle state.
        """
        recent = [f for f in self._faults.values() if now - f[2] <= REMEMBER]
        worst = max(recent, key=lambda f: (f[0], f[2]), default=None)
        status = DiagnosticStatus(
            level=OK if worst is None else worst[0],
            name=self._name,
            hardware_id='',
            message=state if worst is None else worst[1],
        )
        shown = {'state': state, **self.values}
        shown |= {f'{kind} (count)': f[3] for kind, f in self._faults.items()}
        shown |= {f'{kind} (last)': f[1] for kind, f in self._faults.items()}
        status.values = [KeyValue(key=key, value=_text(value)) for key, value in shown.items()]
        found = DiagnosticArray(status=[status])
        found.header.stamp = stamp
        return found


def _text(value: Any) -> str:
    return f'{value:.6g}' if isinstance(value, float) else str(value)
