"""The first of what may be thousands of lines, and how many more there are."""

from __future__ import annotations

from collections.abc import Iterable

MOST = 20


def first_lines(lines: Iterable[str], what: str) -> list[str]:
    """Return the first `MOST` of some lines, each once, and a line on how many more there are.

    Args:
        lines: of one kind.
        what: they are, in the plural.
    """
    once = list(dict.fromkeys(lines))
    more = len(once) - MOST
    return [*once[:MOST], *([f'and {more} more {what}, all in the JSON'] if more > 0 else [])]
