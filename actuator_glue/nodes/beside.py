"""Work beside the executor, such as compiling: a node answers and can be ended meanwhile."""

from __future__ import annotations

import atexit
import os
import sys
import threading
from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from actuator_glue.nodes.base import SuiteNode


class Beside:
    """Does something in a thread; what it raises is reported.

    A process that ends does not wait for it: a compiler cannot be interrupted, and cold it takes
    minutes on a busy computer.

    Args:
        node: whose work it is.
        work: what to do.
    """

    def __init__(self, node: SuiteNode, work: Callable[[], object]) -> None:
        self._node = node
        self._thread = threading.Thread(target=node.guarded(work), name='beside', daemon=True)
        self._thread.start()
        atexit.register(self._leave)

    @property
    def done(self) -> bool:
        """Whether it has come to its end."""
        return not self._thread.is_alive()

    def _leave(self) -> None:
        """End the process at once where the work is not done: it would crash at the very end."""
        if self.done:
            return
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(self._node.exit_code)
