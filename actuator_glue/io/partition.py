"""Partitions of hybrid tests: YAML files, and those that the package brings by name."""

from __future__ import annotations

from pathlib import Path
from reprlib import repr as brief
from typing import Any

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.hybrid.partition import Partition, Specimen, modal_damping, square
from actuator_glue.io.yaml_file import entries, needed, number, read_file, whole
from actuator_glue.records import Array

_LARGEST = 2_000_000  # bytes; matrices are written out
_STRUCTURE = ('mass', 'damping', 'damping_ratio', 'stiffness')
_KNOWN = (
    'name', 'numerical', 'reference', 'interface', 'experimental', 'rate', 'computation_delay',
    'influence', 'noise',
)  # fmt: skip
_OF_SPECIMEN = (*_STRUCTURE, 'mass_sd', 'damping_sd', 'stiffness_sd')


def partition_file(given: Path | str) -> tuple[Path, object]:
    """Return the file of a partition, there or of the package by its name, and what it says.

    Raises:
        InputError: no such file or name, no YAML.
    """
    hint = 'give the YAML file that describes a hybrid test'
    return read_file(given, 'partition', hint, 'partitions', _LARGEST)


def read_partition(given: Path | str) -> Partition:
    """Return the partition of a YAML file, or one that comes with the package by its name.

    Raises:
        InputError: no such file or name, no YAML, unknown or missing entries, wrong values.
    """
    path, content = partition_file(given)
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
    where = 'partition'
    values = entries(content, _KNOWN, where)
    given = [s for s in ('numerical', 'reference') if s in values]
    if len(given) != 1:
        raise InputError(
            'give one of `numerical` (what the computer simulates) and `reference` (the whole '
            f'structure), not {"both" if given else "none"}'
        )
    (part,) = given
    structure = entries(values[part], _STRUCTURE, part)
    stiffness = square(needed(structure, 'stiffness', part), f'{part}: stiffness')
    mass = square(needed(structure, 'mass', part), f'{part}: mass')
    mass = float(mass[0, 0]) * np.eye(len(stiffness)) if mass.size == 1 else mass
    if _by_ratio(structure, part):
        if mass.shape != stiffness.shape:
            raise InputError(f'{part}: mass {mass.shape} and stiffness {stiffness.shape}')
        damping = modal_damping(mass, stiffness, structure['damping_ratio'])
    else:
        damping = square(needed(structure, 'damping', part), f'{part}: damping')
    needed(values, 'rate', where)
    number(values, 'rate', where)
    number(values, 'computation_delay', where)
    whole(values, 'interface', where, lower=1)
    noise = entries(values.get('noise', {}), ('displacement', 'force'), 'noise')
    for channel in noise:
        number(noise, channel, 'noise')
    partition = Partition(
        mass=mass,
        damping=damping,
        stiffness=stiffness,
        specimen=_specimen(needed(values, 'experimental', where)),
        rate=values['rate'],
        interface=values.get('interface', 1) - 1,
        computation_delay=values.get('computation_delay', 0.0),
        displacement_noise=noise.get('displacement', 0.0),
        force_noise=noise.get('force', 0.0),
        influence=_influence(values.get('influence')),
        name=str(values.get('name') or name),
    )
    return partition.without_specimen() if part == 'reference' else partition


def _specimen(content: object) -> Specimen:
    where = 'experimental'
    values = entries(content, _OF_SPECIMEN, where)
    for name in _OF_SPECIMEN:
        number(values, name, where)
    mass, stiffness = (needed(values, n, where) for n in ('mass', 'stiffness'))
    if _by_ratio(values, where):
        if mass * stiffness < 0.0:
            raise InputError(f'{where}: mass and stiffness must not be negative')
        damping = 2.0 * values['damping_ratio'] * (mass * stiffness) ** 0.5
    else:
        damping = needed(values, 'damping', where)
    spread = {n[:-3]: v for n, v in values.items() if n.endswith('_sd')}
    return Specimen(mass, damping, stiffness, spread)


def _by_ratio(values: dict[str, Any], where: str) -> bool:
    """Whether a structure's damping is given by its ratio, which is made a number."""
    number(values, 'damping_ratio', where)
    if {'damping_ratio', 'damping'} <= set(values):
        raise InputError(f'{where}: give damping or damping_ratio, not both')
    return 'damping_ratio' in values


def _influence(value: object) -> Array | None:
    if value is None:
        return None
    if not isinstance(value, list) or None in value:
        raise InputError(f'influence must be a list of numbers, not {brief(value)}')
    listed = {f'influence[{i}]': entry for i, entry in enumerate(value)}
    for name in listed:
        number(listed, name, 'partition')
    return np.array([*listed.values()], dtype=np.float64)
