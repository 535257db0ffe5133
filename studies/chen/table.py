"""A table of numbers, defined once for the page, for CSV and for JSON."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from actuator_glue.report import html
from studies.chen.library import Array
from studies.chen.words import num, percent

# Unit of a column -> unit, scale and significant digits on the page. [1] is a share.
SHOWN = {'m': ('µm', 1e6, 3), 's': ('ms', 1e3, 3), 'rad': ('deg', 180.0 / math.pi, 4)}


@dataclass(frozen=True, slots=True)
class StudyTable:
    """Rows of raw values: text, numbers, answers, None where there is none.

    Attributes:
        keys: names of the columns, SI units in brackets; shares have the unit [1], relative
            differences begin with 'off'.
        rows: as long as the keys.
    """

    keys: Sequence[str]
    rows: Sequence[Sequence[Any]]

    def page(self, caption: str) -> html.Table:
        """Return the table for the page, in the units that people read."""
        heads = [_heading(key) for key in self.keys]
        rows = [[_shown(k, v) for k, v in zip(self.keys, r, strict=True)] for r in self.rows]
        return html.Table(heads, rows, caption)

    def records(self) -> list[dict[str, Any]]:
        """Return one object per row, for JSON."""
        return [dict(zip(self.keys, row, strict=True)) for row in self.rows]

    def write(self, path: Path) -> None:
        """Write the table as CSV."""
        write_csv(path, self.keys, self.rows)


def _unit(key: str) -> str:
    return key.rpartition(' [')[2].removesuffix(']') if key.endswith(']') else ''


def _heading(key: str) -> str:
    unit, name = _unit(key), key.rpartition(' [')[0]
    return name if unit == '1' else f'{name} [{SHOWN[unit][0]}]' if unit in SHOWN else key


def _shown(key: str, value: Any) -> str:
    if isinstance(value, str):
        return value
    if isinstance(value, (bool, np.bool_)):
        return 'yes' if value else 'no'
    unit = _unit(key)
    if unit == '1':
        return percent(value, sign=key.startswith('off'))
    _, scale, digits = SHOWN.get(unit, ('', 1.0, 4))
    return f'{value:g}' if isinstance(value, int) else num(value, digits, scale)


def write_curve(path: Path, columns: Mapping[str, Array]) -> None:
    """Write columns of one length as CSV, units in their names."""
    write_csv(path, columns, zip(*columns.values(), strict=True))


def write_csv(path: Path, header: Iterable[str], rows: Iterable[Iterable[Any]]) -> None:
    """Write rows as CSV, numbers with nine significant digits."""
    with path.open('w', newline='', encoding='utf-8') as file:
        writer = csv.writer(file)
        writer.writerow(header)
        writer.writerows([_cell(value) for value in row] for row in rows)


def _cell(value: Any) -> str:
    if value is None or isinstance(value, (str, bool, np.bool_)):
        return '' if value is None else str(value)
    return f'{value:.9g}'
