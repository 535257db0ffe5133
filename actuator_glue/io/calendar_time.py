"""Whether a stamp is a date, and which."""

from __future__ import annotations

from datetime import UTC, datetime

# Clocks that count from a start of their own, of a test or a controller, stay below this [s].
_FIRST = datetime(2000, 1, 1, tzinfo=UTC).timestamp()


def calendar_time(stamp_ns: int) -> datetime | None:
    """Return the moment of a stamp in UTC.

    Args:
        stamp_ns: nanoseconds since 1970, or of a clock with a start of its own.

    Returns:
        None before the year 2000: such a stamp counts from the start of a test or a computer.
    """
    seconds = stamp_ns * 1e-9
    return datetime.fromtimestamp(seconds, UTC) if seconds >= _FIRST else None
