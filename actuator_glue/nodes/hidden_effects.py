"""The truth about a simulated actuator, sealed: effects that nobody is told of."""

from __future__ import annotations

import json
import os
from pathlib import Path

from actuator_glue.errors import InputError
from actuator_glue.model.parameters import BASE
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array

SCHEMA = 'actuator_glue.sealed/1'


def seal(path: Path, structure: Structure, theta: Array) -> None:
    """Write the truth where only its owner reads it, complete or not at all.

    Args:
        path: file to write.
        structure: what the plant has.
        theta: its parameters, (p,).

    Raises:
        InputError: the file cannot be written.
    """
    values = dict(zip(structure.names, theta.tolist(), strict=True))
    truth = {
        'schema': SCHEMA,
        'effects': {
            e.name: {p.name: values[p.name] for p in e.parameters} for e in structure.entries
        },
        'parameters': {p.name: values[p.name] for p in BASE},
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
