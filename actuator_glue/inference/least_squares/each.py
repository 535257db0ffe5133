"""Calls of one function, several at a time or one after the other."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Protocol, TypeVar

_T = TypeVar('_T')
_R = TypeVar('_R')


class Each(Protocol):
    """Calls a function with each of some arguments, as `map` does, perhaps several at a time.

    What is called must not wait for another such call: all threads could wait for each other.
    """

    def __call__(self, function: Callable[[_T], _R], arguments: Iterable[_T], /) -> Iterable[_R]:
        """Yield results in the order of the arguments."""
