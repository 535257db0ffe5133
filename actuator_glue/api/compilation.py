"""How long compilation took, which only the first use of an installation pays."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def compilation() -> Iterator[list[float]]:
    """Yield a list that at the end holds the seconds numba compiled in the `with` block."""
    from numba.core import event

    found: list[float] = []
    with event.install_timer('numba:compile', found.append):
        yield found
