"""Effects that a simulated actuator has and nobody is told of."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.model.effects import CATALOGUE, scale
from actuator_glue.model.parameters import BASE
from actuator_glue.records import Array, Record

SCHEMA = 'actuator_glue.sealed/1'
FORM = 'effects are written NAME, or NAME:PARAMETER=VALUE,PARAMETER=VALUE, joined by +'


def parse(text: str) -> dict[str, dict[str, float]]:
    """Return the parameters given for each effect, by name.

    Raises:
        InputError: unknown effect or parameter, a value that is no number.
    """
    found: dict[str, dict[str, float]] = {}
    for part in filter(None, (piece.strip() for piece in text.split('+'))):
        name, _, given = (piece.strip() for piece in part.partition(':'))
        if name not in CATALOGUE:
            raise InputError(f'effect {name!r} is not in the catalogue; known: {list(CATALOGUE)}')
        known = {p.name for p in CATALOGUE[name].parameters}
        values: dict[str, float] = {}
        for pair in filter(None, given.split(',')):
            key, _, value = (piece.strip() for piece in pair.partition('='))
            try:
                values[key] = float(value)
            except ValueError as error:
                raise InputError(
                    f'effect {name}: {pair!r} is no PARAMETER=VALUE; {FORM}'
                ) from error
            if key not in known:
                raise InputError(f'effect {name} has no parameter {key!r}; it has {sorted(known)}')
        found[name] = values
    return found


def sizes(
    given: Mapping[str, Mapping[str, float]], base: Array, record: Record
) -> dict[str, dict[str, float]]:
    """Return every parameter of every effect; what is not given takes a size typical of the test.

    Args:
        given: from `parse`.
        base: parameters of Eq. (2), shape (4,).
        record: command, stiffness and period of the test.
    """
    typical = scale([record], base)
    full = {}
    for name, values in given.items():
        effect = CATALOGUE[name]
        rows = np.atleast_2d(np.array(effect.starts(typical), dtype=np.float64))
        usual = rows[len(rows) // 2]
        names = [p.name for p in effect.parameters]
        full[name] = {n: float(v) for n, v in zip(names, usual, strict=True)} | dict(values)
    return full


def seal(path: Path, effects: Mapping[str, Mapping[str, float]], base: Array) -> None:
    """Write the truth where only its owner reads it, complete or not at all.

    Raises:
        InputError: the file cannot be written.
    """
    truth = {
        'schema': SCHEMA,
        'effects': {name: dict(values) for name, values in effects.items()},
        'parameters': {p.name: float(v) for p, v in zip(BASE, base, strict=True)},
    }
    partial = path.with_name(path.name + '.part')
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with os.fdopen(
            os.open(partial, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600), 'w'
        ) as file:
            json.dump(truth, file, indent=2)
        partial.replace(path)
    except OSError as error:
        raise InputError(
            f'sealed file {path}: {error.strerror}; give sealed_file a path'
        ) from error
