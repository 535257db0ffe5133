"""Options of a function, as an object or by name."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Mapping
from dataclasses import MISSING, Field, fields, replace
from typing import TYPE_CHECKING, Any, TypeVar

from actuator_glue.errors import InputError
from actuator_glue.given import of_kind

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Options = TypeVar('Options', bound='DataclassInstance')
Function = TypeVar('Function', bound=Callable[..., Any])


def chosen(
    kind: type[Options], options: Options | None, changes: Mapping[str, Any], function: str
) -> Options:
    """Return options with some of them replaced.

    Args:
        kind: a dataclass, whose fields are the options.
        options: what was given as one object; None for the defaults.
        changes: what was given by name.
        function: whose options they are, for messages.

    Raises:
        InputError: options of another kind, no such option, or a value that cannot be used.
    """
    options = kind() if options is None else options
    of_kind(
        options,
        'options',
        kind,
        f'{kind.__name__}, or each option by name; several records go into one list, as in '
        f'{function}([free, clamped])',
    )
    known = [f.name for f in fields(options)]
    unknown = sorted(set(changes) - set(known))
    if unknown:
        raise InputError(
            f'{function} has no option {", ".join(unknown)}; it has {", ".join(known)}'
        )
    return replace(options, **changes)


def takes(options: type[DataclassInstance]) -> Callable[[Function], Function]:
    """Make a function that ends in `**changes` show each option: to `help`, completion, the docs.

    Names, defaults and descriptions are those of the options, told once; type checkers know them
    by the `TypedDict` that the function unpacks.

    Args:
        options: a dataclass whose fields are the options, each described under `Attributes:`.
    """

    def shown(function: Function) -> Function:
        signature = inspect.signature(function)
        own = [p for p in signature.parameters.values() if p.kind is not p.VAR_KEYWORD]
        told = {p.name for p in own}
        named = [
            inspect.Parameter(
                f.name, inspect.Parameter.KEYWORD_ONLY, default=_default(f), annotation=f.type
            )
            for f in fields(options)
            if f.name not in told
        ]
        vars(function)['__signature__'] = signature.replace(parameters=[*own, *named])
        if function.__doc__ and options.__doc__:  # python -OO leaves none
            attributes = options.__doc__.partition('Attributes:\n')[2].split('\n\n')[0].rstrip()
            function.__doc__ = re.sub(
                r'^ *changes: .*$', lambda _: attributes, function.__doc__, flags=re.MULTILINE
            )
        return function

    return shown


def _default(field: Field[Any]) -> Any:
    return field.default if field.default_factory is MISSING else field.default_factory()
