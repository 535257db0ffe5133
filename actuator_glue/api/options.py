"""Options of a function, as an object or by name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace
from typing import TYPE_CHECKING, Any, TypeVar

from actuator_glue.errors import InputError

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Options = TypeVar('Options', bound='DataclassInstance')


def chosen(options: Options, changes: Mapping[str, Any], function: str) -> Options:
    """Return options with some of them replaced; `function` is whose they are, for messages.

    Raises:
        InputError: no such option, or a value that cannot be used.
    """
    known = [f.name for f in fields(options)]
    unknown = sorted(set(changes) - set(known))
    if unknown:
        raise InputError(
            f'{function} has no option {", ".join(unknown)}; it has {", ".join(known)}'
        )
    return replace(options, **changes)
