"""What is told beside a record: raised, warned of, or handed to whoever asked for it."""

from __future__ import annotations

import inspect
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import NoReturn, TypeAlias

from actuator_glue.errors import InputError

# Takes one line.
Note: TypeAlias = Callable[[str], None]


def refuse(message: str) -> NoReturn:
    """Raise a note: the default for damage, unless the caller passes over it."""
    raise InputError(message)


def warn_caller(message: str) -> None:
    """Warn of a note, at the line of the caller's own code: the default for what is told."""
    package = f'{Path(__file__).parents[1]}/'
    own = (i for i, f in enumerate(inspect.stack(0), 1) if not f.filename.startswith(package))
    warnings.warn(message, stacklevel=next(own, 1))


def tell_gap(fault: str, gap: Note | None, beside: str = '') -> None:
    """Tell where a record is parted, and what is done beside.

    Raises:
        InputError: nobody asked for parts.
    """
    if gap is None:
        raise InputError(f'{fault}; take the stretches as records of their own with --split')
    gap(
        '; '.join(filter(None, (fault, beside, 'the stretches are taken as records of their own')))
    )
