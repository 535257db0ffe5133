"""Which of many records a report draws: those that the model leaves most of."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

MOST = 12

T = TypeVar('T')


def worst(found: Sequence[T], left: Callable[[T], float]) -> list[T]:
    """Return the `MOST` of which most is left, in their order; all where there are no more.

    Args:
        found: what may be drawn.
        left: how much is left of one.
    """
    order = sorted(range(len(found)), key=lambda i: -left(found[i]))
    return [found[i] for i in sorted(order[:MOST])]


def chosen(count: int, what: str) -> str:
    """Return what a caption says of the choice among some; nothing where all are drawn.

    Args:
        count: of them.
        what: they are, in the plural.
    """
    return f' The {MOST} of {count} {what} with the largest residual.' if count > MOST else ''
