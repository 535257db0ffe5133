"""What callers give: records, themselves or as files; times; seeds, or none."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import replace
from datetime import timedelta
from typing import Any, Literal, TypeAlias

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.given import number, one_thing, whole
from actuator_glue.io.load import load_records
from actuator_glue.records import Record

OneRecord: TypeAlias = Record | os.PathLike[str] | str
Records: TypeAlias = OneRecord | Iterable[OneRecord]
Stiffness: TypeAlias = float | Literal['unknown'] | Sequence[float | Literal['unknown']] | None


def records_given(
    given: Records, stiffness: Stiffness = None, name: str = 'records'
) -> list[Record]:
    """Return records that were given themselves, as paths, or as a mixture of both.

    Args:
        given: one or several.
        stiffness: specimen stiffness [N/m], one for all or one for each that was given; None for
            what records and files say, which 'unknown' leaves aside.
        name: of the argument, for messages.

    Raises:
        InputError: something else was given, or a file cannot be read.
    """
    some: list[Any]
    if isinstance(given, (Record, os.PathLike)) or one_thing(given):
        some = [given]
    else:
        try:
            some = list(given)
        except TypeError:
            some = [given]
    if not some:
        raise InputError(f'{name}: no record given')
    known: list[Any] = [stiffness] * len(some)
    if np.ndim(0.0 if stiffness is None else np.asarray(stiffness, dtype=object)) == 1:
        known = list(np.asarray(stiffness, dtype=object))
        if len(known) != len(some):
            raise InputError(f'{len(known)} stiffnesses for {len(some)} {name}: one for each')
    out: list[Record] = []
    for one, k in zip(some, known, strict=True):
        if isinstance(one, Record):
            told = None if isinstance(k, str) and k == 'unknown' else k
            out.append(one if k is None else replace(one, stiffness=told))
        elif isinstance(one, (str, os.PathLike)):
            out += load_records(os.fspath(one), stiffness=k)
        else:
            raise InputError(
                f'{name}: {type(one).__name__} is no record; give what `load` or `simulate` '
                'return, the path of a file or bag, or a list of these; `Record.from_arrays` '
                'makes a record of columns'
            )
    motions = dict.fromkeys(record.motion for record in out)
    if len(motions) > 1:
        raise InputError(
            f'{name}: one moves in {" and another in ".join(motions)}; what is fitted together '
            'moves in one unit: give a `scale` in a channel map'
        )
    return out


def one_record_given(given: OneRecord) -> Record:
    """Return a record that was given itself or as the path of a file that holds just one.

    Raises:
        InputError: as `records_given`, or several.
    """
    found = records_given(given, name='record')
    if len(found) != 1:
        raise InputError(f'{len(found)} records; give one')
    return found[0]


def seconds(value: object, name: str) -> float:
    """Return a time [s] that was given as a number of seconds or as a `timedelta`.

    Raises:
        InputError: as `number`.
    """
    return value.total_seconds() if isinstance(value, timedelta) else number(value, name)


def seed_given(seed: object) -> int:
    """Return a seed; for None a fresh one, which the result says.

    Raises:
        InputError: no whole number, or a negative one.
    """
    if seed is None:
        return int(np.random.SeedSequence().generate_state(1)[0])
    found = whole(seed, 'seed')
    if found < 0:
        raise InputError(f'seed {found} is negative')
    return found
