"""Partitions of hybrid tests: YAML files, and those that the package brings by name."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from pathlib import Path
from reprlib import repr as brief
from typing import Any

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.hybrid.partition import Partition, Specimen, modal_damping, square
from actuator_glue.io.signature import text_encoding
from actuator_glue.io.yaml_file import located, parse, shipped
from actuator_glue.records import Array

FOLDER = 'partitions'  # of the package, with those that it brings
_LARGEST = 2_000_000  # bytes
_STRUCTURE = ('mass', 'damping', 'damping_ratio', 'stiffness')
_KNOWN = {
    '': ('name', 'numerical', 'reference', 'interface', 'experimental', 'rate',
         'computation_delay', 'influence', 'noise'),
    'numerical': _STRUCTURE,
    'reference': _STRUCTURE,
    'experimental': (*_STRUCTURE, 'mass_sd', 'damping_sd', 'stiffness_sd'),
    'noise': ('displacement', 'force'),
}  # fmt: skip


def read_partition(given: Path | str) -> Partition:
    """Return the partition of a YAML file, or one that comes with the package by its name.

    Raises:
        InputError: no such file or name, no YAML, unknown or missing entries, wrong values.
    """
    path = located(given, FOLDER)
    try:
        if path.stat().st_size > _LARGEST:
            raise InputError(f'{path}: is no partition but a file of {path.stat().st_size} bytes')
        content = parse(path.read_text(text_encoding(path)), f'{path}: partition')
    except OSError as error:
        raise InputError(
            f'{path}: partition cannot be read ({error.strerror}); give a YAML file, or one of '
            f'{", ".join(shipped(FOLDER))}'
        ) from error
    except UnicodeDecodeError as error:
        raise InputError(f'{path}: partition is not text in UTF-8') from error
    try:
        return parse_partition(content, path.stem)
    except InputError as error:
        raise InputError(f'{path}: {error}') from error


def parse_partition(content: object, name: str = 'partition') -> Partition:
    """Return the partition that a mapping describes.

    Args:
        content: `numerical` or `reference`, `experimental`, `rate`, and where wanted `name`,
            `interface`, `computation_delay`, `influence`, `noise`.
        name: name of a partition that gives none.

    Raises:
        InputError: unknown or missing entries, wrong values.
    """
    entries = _mapping(content, '')
    given = [s for s in ('numerical', 'reference') if entries.get(s) is not None]
    if len(given) != 1:
        raise InputError(
            'give one of `numerical` (what the computer simulates) and `reference` (the whole '
            f'structure), not {"both" if given else "none"}'
        )
    structure = _mapping(entries[given[0]], given[0])
    stiffness = square(_needed(structure, 'stiffness', given[0]), f'{given[0]}: stiffness')
    mass = _mass(_needed(structure, 'mass', given[0]), len(stiffness), f'{given[0]}: mass')
    if structure.get('damping_ratio') is not None:
        _one_damping(structure, given[0])
        ratio = _number(structure['damping_ratio'], f'{given[0]}: damping_ratio')
        if mass.shape != stiffness.shape:
            raise InputError(f'{given[0]}: mass {mass.shape} and stiffness {stiffness.shape}')
        damping = modal_damping(mass, stiffness, ratio)
    else:
        damping = square(_needed(structure, 'damping', given[0]), f'{given[0]}: damping')
    interface = entries.get('interface', 1)
    if isinstance(interface, bool) or not isinstance(interface, int):
        raise InputError(f'interface is {brief(interface)}; give a whole number, counted from 1')
    noise = {
        name: _number(value, f'noise: {name}')
        for name, value in _mapping(entries.get('noise') or {}, 'noise').items()
    }
    partition = Partition(
        mass=mass,
        damping=damping,
        stiffness=stiffness,
        specimen=_specimen(_mapping(_needed(entries, 'experimental', ''), 'experimental')),
        rate=_number(_needed(entries, 'rate', ''), 'rate'),
        interface=interface - 1,
        computation_delay=_number(entries.get('computation_delay', 0.0), 'computation_delay'),
        displacement_noise=noise.get('displacement', 0.0),
        force_noise=noise.get('force', 0.0),
        influence=_influence(entries.get('influence')),
        name=str(entries.get('name') or name),
    )
    return partition.without_specimen() if given[0] == 'reference' else partition


def _specimen(entries: Mapping[str, Any]) -> Specimen:
    where = 'experimental'
    numbers = {name: _number(value, f'{where}: {name}') for name, value in entries.items()}
    mass, stiffness = (_needed(numbers, n, where) for n in ('mass', 'stiffness'))
    if 'damping_ratio' in numbers:
        _one_damping(entries, where)
        product = mass * stiffness
        if product < 0.0:
            raise InputError(f'{where}: mass and stiffness must not be negative')
        damping = 2.0 * numbers['damping_ratio'] * product**0.5
    else:
        damping = _needed(numbers, 'damping', where)
    spread = {n[:-3]: value for n, value in numbers.items() if n.endswith('_sd')}
    return Specimen(mass, damping, stiffness, spread)


def _influence(value: object) -> Array | None:
    if value is None:
        return None
    if not isinstance(value, list):
        raise InputError(f'influence must be a list of numbers, not {brief(value)}')
    return np.array([_number(v, 'influence') for v in value])


def _mass(value: Any, count: int, where: str) -> Array:
    matrix = square(value, where)
    return float(matrix[0, 0]) * np.eye(count) if matrix.size == 1 else matrix


def _one_damping(entries: Mapping[str, Any], where: str) -> None:
    if entries.get('damping') is not None:
        raise InputError(f'{where}: give damping or damping_ratio, not both')


def _mapping(content: object, where: str) -> dict[str, Any]:
    place = f'{where}: ' if where else ''
    if not isinstance(content, Mapping):
        raise InputError(f'{place}a mapping of names to values is needed, not {brief(content)}')
    for name in content:
        if name not in _KNOWN[where]:
            near = difflib.get_close_matches(str(name), _KNOWN[where], 1)
            hint = f'did you mean {near[0]}?' if near else f'known are {", ".join(_KNOWN[where])}'
            raise InputError(f'{place}unknown entry {name!r}; {hint}')
    return dict(content)


def _needed(entries: Mapping[str, Any], name: str, where: str) -> Any:
    if entries.get(name) is None:
        raise InputError(f'{where + ": " if where else ""}{name} is missing')
    return entries[name]


def _number(value: object, where: str) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float, str)):
        raise InputError(f'{where} must be a number, not {brief(value)}')
    try:
        return float(value)  # YAML 1.1 reads 1e6 without a point as text
    except ValueError as error:
        raise InputError(f'{where} must be a number, not {value!r}') from error
