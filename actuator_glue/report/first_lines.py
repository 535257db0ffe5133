"""The first of what may be thousands of lines, and how many more there are."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TypeVar

MOST = 20  # of one kind that people still read

T = TypeVar('T')


def few(found: Sequence[T], what: str, where: str) -> tuple[Sequence[T], list[str]]:
    """Return the first `MOST`, and, where there are more, a line on how many.

    Args:
        found: of one kind.
        what: they are, in the plural.
        where: all of them are.
    """
    more = len(found) - MOST
    return found[:MOST], [f'and {more} more {what}, {where}'] if more > 0 else []


def first_lines(lines: Iterable[str], what: str) -> list[str]:
    """Return the first of some lines, each once, and a line on how many more the JSON has.

    Args:
        lines: of one kind.
        what: they are, in the plural.
    """
    first, more = few([*dict.fromkeys(lines)], what, 'all in the JSON')
    return [*first, *more]
