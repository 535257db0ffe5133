"""Libraries that are not always installed, imported where they are first needed."""

from __future__ import annotations

import importlib
from typing import Any

from actuator_glue.errors import InputError


def library(name: str, needed: str, extra: str) -> Any:
    """Return a library of one of the package's extras.

    Args:
        name: of the module.
        needed: what is said where it is not installed, before how to install it.
        extra: the extra that it belongs to.

    Raises:
        InputError: it is not installed; the message says what to install.
    """
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise InputError(
            f"{needed}; install it with `pip install 'actuator_glue[{extra}]'`"
        ) from error
