"""Formats of laboratory files: each file of this folder is one, found by the suffix it names.

A format is a module with `FORMAT`; reading, writing and the help of the commands follow from it.
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from actuator_glue.io.channel_map import ChannelMap
from actuator_glue.records import Array


@dataclass(frozen=True, slots=True)
class FileTable:
    """What a file holds.

    Attributes:
        names: of its columns, in order.
        notes: what it says besides: stiffness_N_per_m, hold, actuator.
        columns: return the columns at positions from 0, each of shape (n,), unscaled.
    """

    names: list[str]
    notes: dict[str, str]
    columns: Callable[[list[int]], list[Array]]


@dataclass(frozen=True, slots=True)
class Format:
    """One format of laboratory files; both functions raise `InputError`.

    Attributes:
        suffix: of its files, lower case with the dot.
        read: table of a file; the channel map tells header lines, delimiter and decimal sign.
        write: write columns and notes to a path.
    """

    suffix: str
    read: Callable[[Path, ChannelMap | None], FileTable]
    write: Callable[[Path, Mapping[str, Array], Mapping[str, str | float]], None]


@cache
def formats() -> dict[str, Format]:
    """Return every format by its suffix."""
    modules = sorted(module.name for module in pkgutil.iter_modules(__path__))
    found = [importlib.import_module(f'{__name__}.{name}').FORMAT for name in modules]
    return {entry.suffix: entry for entry in found}


def format_of(path: Path) -> Format:
    """Return the format of a file; delimited text where its suffix is no other's."""
    return formats().get(path.suffix.lower(), formats()['.csv'])
