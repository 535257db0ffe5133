"""Effects of your own: read from a file, registered, saved.

A registered effect is fitted, simulated, diagnosed and reported as those of the catalogue are.
Files are YAML, or Python with nothing but literals; neither is executed (docs/effects.md).
"""

from __future__ import annotations

import ast
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import yaml

from actuator_glue.errors import InputError
from actuator_glue.given import of_kind
from actuator_glue.given import path as given_path
from actuator_glue.model.effects import CATALOGUE, Effect
from actuator_glue.model.effects.terms.definition import entries, mapping
from actuator_glue.model.effects.terms.entry import term
from actuator_glue.model.parameters import Parameter
from actuator_glue.plain_yaml import plain_yaml
from actuator_glue.whole_file import whole_file

register = CATALOGUE.register
unregister = CATALOGUE.unregister

__all__ = [
    'CATALOGUE',
    'Effect',
    'Parameter',
    'load_effects',
    'read_effects',
    'register',
    'save_effects',
    'term',
    'unregister',
]


def load_effects(path: Path | str) -> tuple[Effect, ...]:
    """Register the effects of a file and return them; replaces what was registered before.

    Raises:
        InputError: as `read_effects`, or a name that the catalogue has.
    """
    found = read_effects(path)
    try:
        CATALOGUE.take(found)
    except InputError as error:
        raise InputError(f'{path}: {error}') from None
    return found


def read_effects(path: Path | str) -> tuple[Effect, ...]:
    """Return the effects of a file: YAML, or a Python file whose EFFECTS is a literal.

    Raises:
        InputError: it cannot be read, or an effect cannot be used; says where.
    """
    path = given_path(path)
    try:
        text = path.read_text(encoding='utf-8')
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else 'it is no text'
        raise InputError(f'{path}: cannot be read ({reason})') from error
    content = _literal(text, path) if path.suffix == '.py' else _yaml(text, path)
    return entries(content, str(path))


def save_effects(path: Path | str, effects: Iterable[Effect]) -> None:
    """Write effects that are written as expressions to a YAML file for `load_effects`.

    Its folder is made if need be.

    Raises:
        InputError: no path, the file cannot be written, or an effect has a compiled stage of its
            own.
    """
    of_kind(effects, 'effects', Iterable, 'several effects, as in [term(...)]')
    chosen = tuple(effects)
    for effect in chosen:
        of_kind(effect, 'effect', Effect, 'what `term` makes')
        if effect.expression is None:
            raise InputError(f'effect {effect.name!r} is not written as an expression')
    text = yaml.safe_dump(mapping(chosen), sort_keys=False, allow_unicode=True)
    with whole_file(given_path(path)) as part:
        part.write_text(text, encoding='utf-8')


def _yaml(text: str, path: Path) -> Any:
    try:
        return plain_yaml(text, str(path))
    except InputError:
        raise
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        mark = getattr(error, 'problem_mark', None)
        where = f', line {mark.line + 1}, column {mark.column + 1}' if mark else ''
        raise InputError(f'{path}{where}: no YAML ({getattr(error, "problem", error)})') from None


def _literal(text: str, path: Path) -> Any:
    """Return the literal EFFECTS of a Python file that has nothing else; nothing is executed."""
    try:
        body = ast.parse(text).body
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        line = getattr(error, 'lineno', None) or 1
        raise InputError(f'{path}, line {line}: no Python ({error})') from None
    found = None
    for node in body:
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            continue  # a docstring
        try:
            match node:
                case ast.Assign(targets=[ast.Name(id='EFFECTS')]):
                    _check_keys(node.value, path)
                    found = ast.literal_eval(node.value)
                case _:
                    raise ValueError
        except InputError:
            raise
        except (ValueError, TypeError, RecursionError):
            raise InputError(
                f'{path}, line {node.lineno}: the file is read, not executed; it may hold '
                'EFFECTS = {...} of literals only'
            ) from None
    return found


def _check_keys(literal: ast.expr, path: Path) -> None:
    for node in ast.walk(literal):
        lines: dict[Any, int] = {}
        for key in node.keys if isinstance(node, ast.Dict) else ():
            if isinstance(key, ast.Constant):
                if key.value in lines:
                    raise InputError(
                        f'{path}: {key.value!r} stands twice, in line {lines[key.value]} and in '
                        f'line {key.lineno}; keep one'
                    )
                lines[key.value] = key.lineno
