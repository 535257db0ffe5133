"""One entry for any file or bag."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import Literal, TypeAlias

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.given import one_of, one_thing
from actuator_glue.given import path as path_given
from actuator_glue.io import laboratory
from actuator_glue.io.bag_mapped import read_mapped
from actuator_glue.io.bag_reader import is_bag
from actuator_glue.io.bag_records import read_records
from actuator_glue.io.channel_map import ChannelMap, channel_map_given
from actuator_glue.io.remarks import Note, refuse, warn_caller
from actuator_glue.io.resample import Resample
from actuator_glue.records import Hold, Record, check_stiffness

Stiffness: TypeAlias = float | Literal['unknown']


def load(
    path: Path | str,
    *,
    stiffness: Stiffness | None = None,
    channels: ChannelMap | Path | str | None = None,
    hold: Hold | None = None,
    resample: Resample | None = None,
) -> Record:
    """Return the one record of a bag or laboratory file.

    Args:
        path: bag folder, .mcap, or a laboratory file of any format.
        stiffness: specimen stiffness [N/m]; None for what the file says.
        channels: channel map for a laboratory file, or one of topics for a bag.
        hold: how the command runs between its samples; None for what the file says.
        resample: samples per second [Hz] to which a jittered clock of a file is made even,
            band-limited; `(27.0, 'lines')` for straight lines between samples.

    Raises:
        InputError: the file cannot be used, or holds several records.
    """
    found = load_records(
        path, stiffness=stiffness, channels=channels, hold=hold, resample=resample
    )
    if len(found) > 1:
        raise InputError(f'{path} holds {len(found)} records; `load_records` returns them all')
    return found[0]


def load_records(
    paths: Sequence[Path | str] | Path | str,
    *,
    stiffness: Sequence[Stiffness] | Stiffness | None = None,
    channels: ChannelMap | Path | str | None = None,
    hold: Hold | None = None,
    resample: Resample | None = None,
    note: Note = refuse,
    gap: Note | None = None,
    warn: Note = warn_caller,
) -> list[Record]:
    """Return the records of bags and laboratory files, in the order given.

    Args:
        paths: bag folders, .mcap, laboratory files; one bag may hold several records.
        stiffness: specimen stiffness [N/m]: one for all, or one per path, or one per record;
            None for what the files say, which 'unknown' leaves aside. What is given wins over what
            the files say.
        channels: channel map for the laboratory files, or for bags where it names topics.
        hold: how the command runs between its samples; None for what the files say.
        resample: samples per second [Hz] to which the jittered clock of a file is made even; an
            even one is left as it is. The record's source tells it. Band-limited;
            `(27.0, 'lines')` for straight lines between samples.
        note: called with one line per damage of a bag; the default raises it.
        gap: called with one line where a bag lacks samples or its clock jumps, and is split
            there; the default raises.
        warn: called with one line per set-up of a bag that cannot be used; the rest is; and
            with what resampling cost.

    Raises:
        InputError: a path cannot be used, its rate or stroke is none of a servo-hydraulic test, or
            the number of stiffnesses does not fit.
    """
    if one_thing(paths) or not isinstance(paths, Iterable):
        paths = [paths]  # type: ignore[list-item]  # what is no path is refused below
    paths = list(paths)
    if not paths:
        raise InputError('no record given')
    for one in paths:
        if not isinstance(one, (str, PathLike)):
            raise InputError(
                f'{type(one).__name__} is no path of a file or bag; give a path, as in '
                "load('test.csv')"
            )
    paths = [path_given(one) for one in paths]
    channels = channel_map_given(channels)
    if hold is not None:
        one_of(hold, 'hold', ('zoh', 'linear'))
    if channels is not None and hold is not None:
        channels = replace(channels, hold=hold)
    groups: list[list[Record]] = []
    for path in paths:
        if is_bag(path):
            if resample is not None:
                raise InputError(f'{path}: bags count their samples; only files are resampled')
            groups.append(_of_bag(path, channels, note, gap, warn))
            continue
        groups.append(
            [laboratory.read(path, channels=channels, hold=hold, resample=resample, warn=warn)]
        )
    records = [record for group in groups for record in group]
    for record in records:
        record.check_scale()
    if hold is not None:
        records = [replace(record, hold=hold) for record in records]
    if stiffness is None:
        return records
    # One number of any type, or several in whatever holds them.
    given = [
        None if k == 'unknown' else check_stiffness(k)
        for k in np.ravel(np.asarray(stiffness, dtype=object))
    ]
    if len(given) == 1:
        given = given * len(records)
    elif len(given) == len(paths):
        given = [k for k, group in zip(given, groups, strict=True) for _ in group]
    if len(given) != len(records):
        found = f'{len(paths)} path(s) with {len(records)} record(s)'
        raise InputError(
            f'{len(given)} stiffnesses for {found}; give one for all, one per path or one per '
            'record, in the same order'
        )
    return [replace(r, stiffness=k) for r, k in zip(records, given, strict=True)]


def _of_bag(
    path: Path | str, channels: ChannelMap | None, note: Note, gap: Note | None, warn: Note
) -> list[Record]:
    if channels is not None and channels.topics:
        return read_mapped(path, channels, note=note, gap=gap, warn=warn)
    return read_records(path, note=note, gap=gap, warn=warn)
