"""How long nothing has come of a stream."""

from __future__ import annotations

from actuator_glue.nodes.base import SuiteNode
from actuator_glue.nodes.health import ERROR

# Silence that is a warning, and one that is an error [s]; a stream that never came is waited for.
SILENT, LOST = 10.0, 30.0


class Silence:
    """How long nothing has come of a stream.

    Args:
        now: monotonic time from which on something is waited for [s].
    """

    def __init__(self, now: float) -> None:
        self._last, self._any = now, False

    def heard(self, now: float) -> None:
        """Note that something has come at a monotonic time [s]."""
        self._last, self._any = now, True

    def tell(self, node: SuiteNode, what: str, now: float) -> None:
        """Show how long nothing has come, complain where that is long; for `do_report`.

        Args:
            node: who listens.
            what: to what.
            now: monotonic time [s].
        """
        seconds = now - self._last
        node.health.values['nothing for (s)'] = round(seconds, 1)
        if seconds > LOST and self._any:
            node.complain('silence', f'nothing comes on {what} for {LOST:g} s and more', ERROR)
        elif seconds > SILENT:
            yet = '' if self._any else ' yet'
            node.complain('silence', f'nothing comes on {what}{yet}')
