"""The rows of a campaign: one file each, named by what it was made from, written in one step."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from actuator_glue import __version__
from actuator_glue.campaigns.grouping import Member, Task
from actuator_glue.errors import InputError
from actuator_glue.given import path as path_given
from actuator_glue.io.bag_reader import bag_files, is_bag
from actuator_glue.json_value import json_value
from actuator_glue.optional_library import library
from actuator_glue.whole_file import replaced

if TYPE_CHECKING:
    from pandas import DataFrame

RESULTS = 'results.parquet'
# Between entries of one cell.
BETWEEN = '; '
_FOLDER = 'rows'
# Rows that become one table at a time.
_CHUNK = 5000
Row = dict[str, Any]


def fingerprint(task: Task) -> str:
    """Return a mark by which a task is known without reading its files: their sizes and times."""
    stats: list[Any] = []
    for member in task.members:
        for path in _files(member):
            try:
                stat = path.stat()
                stats.append([str(path), stat.st_size, stat.st_mtime_ns])
            except OSError:
                stats.append([str(path), None, None])
    return _digest([task.to_json(), stats, __version__])


def content(task: Task) -> list[str]:
    """Return the SHA-256 of each of a task's files; empty for one that cannot be read."""
    out = []
    for member in task.members:
        digest = hashlib.sha256()
        try:
            for path in _files(member):
                with path.open('rb') as file:
                    while part := file.read(1 << 20):
                        digest.update(part)
            out.append(digest.hexdigest())
        except OSError:
            out.append('')
    return out


def key_of(task: Task, hashes: list[str]) -> str:
    """Return the name of a task's row: of its files' content, the recipe and the version.

    Where the files are is no part of it.
    """
    value = task.to_json()
    for member in value['members']:
        del member['path']
    return _digest([value, hashes, __version__])[:32]


def _files(member: Member) -> list[Path]:
    path = Path(member.path)
    try:
        return bag_files(path, note=lambda _: None) if is_bag(path) else [path]
    except (InputError, OSError):
        return [path]


def _digest(value: Any) -> str:
    text = json.dumps(json_value(value), sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


class RowFolder:
    """The rows in the folder of a campaign.

    Whoever writes a row writes all of it to a file of its own and renames that: a task that runs
    twice leaves one row, and a reader finds all of a row or none.
    """

    def __init__(self, folder: Path | str) -> None:
        self.folder = Path(folder)

    def path(self, key: str) -> Path:
        """Return where the row of a key is."""
        return self.folder / _FOLDER / key[:2] / f'{key}.json'

    def write(self, key: str, row: Row) -> None:
        """Write a row.

        Raises:
            OSError: the folder cannot be written.
        """
        text = json.dumps(json_value(row), allow_nan=False)
        self.path(key).parent.mkdir(parents=True, exist_ok=True)
        with replaced(self.path(key)) as part:
            part.write_text(text, 'utf-8')

    def read(self, key: str) -> Row | None:
        """Return a row; None where there is none, or none that is whole."""
        return _read(self.path(key))

    def all(self) -> Iterator[tuple[str, Row]]:
        """Yield key and row of every row there is."""
        for path in sorted((self.folder / _FOLDER).glob('??/[0-9a-f]*.json')):
            row = _read(path)
            if row is not None:
                yield path.stem, row

    def gather(self, keys: dict[str, str]) -> DataFrame:
        """Write `results.parquet` and return its table: the row of each group.

        Args:
            keys: of the groups that this run had, the key of their row; of others, as of runs
                over other files, the row that was made last is taken. One that holds a file of
                this run is left out: it was grouped or named otherwise, and no test counts twice.
        """
        import pandas as pd

        newest: dict[str, tuple[str, str]] = {}
        held: dict[str, frozenset[tuple[str, str]]] = {}
        for key, row in self.all():
            group, made = row['group'], row['finished']
            if keys.get(group, key) == key and (made, key) > newest.get(group, ('', '')):
                newest[group] = (made, key)
                held[group] = contents(row)
        now = frozenset().union(*(held[group] for group in held.keys() & keys))
        newest = {g: last for g, last in newest.items() if g in keys or not held[g] & now}
        chosen = [key for _, (_, key) in sorted(newest.items())]
        tables = [
            pd.DataFrame([_flat(self.read(key)) for key in chosen[i : i + _CHUNK]])
            for i in range(0, len(chosen), _CHUNK)
        ]
        table = pd.concat(tables, ignore_index=True) if tables else pd.DataFrame()
        with replaced(self.folder / RESULTS) as part:
            table.to_parquet(part, index=False)
        return table


def contents(row: Row) -> frozenset[tuple[str, str]]:
    """Return what a row was made from: of each file that could be read, whose it is and its hash.

    Equal files of two actuators are of two tests, as simulated ones may be.
    """
    hashes = str(row.get('sha256') or '').split(BETWEEN)
    return frozenset((str(row.get('actuator')), one) for one in hashes if one)


def _read(path: Path) -> Row | None:
    try:
        row = json.loads(path.read_text('utf-8'))
    except (OSError, ValueError):
        return None
    return row if isinstance(row, dict) and 'group' in row else None


def _flat(row: Row | None) -> Row:
    """Return a row of numbers and texts: what holds more is JSON in its cell."""
    return {
        name: json.dumps(value) if isinstance(value, (dict, list)) else value
        for name, value in (row or {}).items()
    }


def read_results(folder: Path | str) -> DataFrame:
    """Return the table of a campaign.

    Raises:
        InputError: no campaign was run there, or the table cannot be read.
    """
    path = path_given(folder) / RESULTS
    if not path.is_file():
        raise InputError(f'{folder}: no {RESULTS} here; run `actuator-glue campaign` first')
    pandas = needed('pandas', 'a campaign')
    needed('pyarrow', 'a campaign')
    try:
        table: DataFrame = pandas.read_parquet(path)
    except Exception as error:  # damage shows in any of them
        raise InputError(f'{path}: cannot be read as Parquet ({error})') from error
    if 'group' not in table:
        raise InputError(f'{path}: has no column `group`; it is of no campaign')
    return table


def needed(module: str, what: str) -> Any:
    """Return a library of the extra `campaign`.

    Raises:
        InputError: it is not installed; the message says what to install.
    """
    return library(module, f'{what} needs {module}', 'campaign')
