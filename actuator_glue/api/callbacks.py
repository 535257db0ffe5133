"""Functions of callers that are told of progress: what they do wrong ends no answer."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import ParamSpec

P = ParamSpec('P')


def harmless(told: Callable[P, object]) -> Callable[P, None]:
    """Return a callback whose first failure is a warning and its last call.

    What is not an `Exception`, as the interrupt of a keyboard, ends the work as ever.
    """
    failed = False

    def tell(*args: P.args, **kwargs: P.kwargs) -> None:
        nonlocal failed
        if failed:
            return
        try:
            told(*args, **kwargs)
        except Exception as error:
            failed = True
            warnings.warn(
                f'the progress callback failed and is not called again: {error!r}',
                RuntimeWarning,
                stacklevel=2,
            )

    return tell
