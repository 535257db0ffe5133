"""YAML as plain data: no objects, no key twice in a mapping, no number that is another one."""

from __future__ import annotations

import re
from typing import Any

import yaml

from actuator_glue.errors import InputError

_OTHER_BASE = re.compile(r'[+-]?(?:0[0-9_]+$|[0-9_]+:)')
_MERGED = 'tag:yaml.org,2002:merge'  # `<<`, which may stand beside keys that it brings


class _OnceEach:
    """What makes a loader of PyYAML refuse a mapping with a key twice."""

    def __init__(self, text: str) -> None:
        super().__init__(text)  # type: ignore[call-arg]  # of the loader beside
        self._seen: set[yaml.Node] = set()

    def flatten_mapping(self: Any, node: yaml.MappingNode) -> None:
        """Bring into a mapping what `<<` says, once its own keys are known to differ.

        Raises:
            InputError: a key stands twice; says where.
        """
        # What is merged into two others comes here again, with the keys that it has merged.
        if node not in self._seen:
            self._seen.add(node)
            _check(self, node)
        super().flatten_mapping(node)  # type: ignore[misc]  # of the loader beside


def _check(loader: Any, node: yaml.MappingNode) -> None:
    lines: dict[Any, int] = {}
    for key, _ in node.value:
        if isinstance(key, yaml.ScalarNode) and key.tag != _MERGED:
            name, line = loader.construct_object(key), key.start_mark.line + 1
            if name in lines:
                raise InputError(
                    f'{name!r} stands twice, in line {lines[name]} and in line {line}; keep one'
                )
            lines[name] = line


class _Loader(_OnceEach, yaml.SafeLoader):
    """Every text but metadata of bags: its errors show the line."""


def _decimal(loader: Any, node: yaml.ScalarNode) -> int | float:
    """Return a number that everybody reads as this one.

    Raises:
        InputError: YAML 1.1 reads `0500` to the base of 8 and `1:30` to that of 60; says where.
    """
    text = str(node.value)
    if _OTHER_BASE.match(text):
        raise InputError(
            f'{text} in line {node.start_mark.line + 1} is not read as it looks: leave out '
            "leading zeros and colons; what is no number stands in quotes ('0500')"
        )
    if node.tag.endswith(':int'):
        return int(loader.construct_yaml_int(node))
    return float(loader.construct_yaml_float(node))


for _kind in ('int', 'float'):
    _Loader.add_constructor(f'tag:yaml.org,2002:{_kind}', _decimal)


class _QuickLoader(_OnceEach, getattr(yaml, 'CSafeLoader', yaml.SafeLoader)):  # type: ignore[misc]  # known at run time
    """By libyaml, where PyYAML was built with it: ten times as fast."""


def plain_yaml(text: str, where: str, *, quick: bool = False) -> Any:
    """Return what YAML text says; only plain data, no objects.

    Args:
        text: the text.
        where: file and what it is to be, for messages.
        quick: read it with libyaml, whose messages say less.

    Raises:
        InputError: a key stands twice in one mapping; or, unless it is read quickly, a number has
            a leading zero or a colon.
        yaml.YAMLError: no YAML.
        ValueError: a date that is none, such as 2001-99-99.
        RecursionError: a thousand brackets.
    """
    try:
        return yaml.load(text, _QuickLoader if quick else _Loader)
    except InputError as error:
        raise InputError(f'{where}: {error}') from None
