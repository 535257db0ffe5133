"""From files to tasks: what names, a table or the files themselves say of actuator and day."""

from __future__ import annotations

import csv
import os
import re
from collections import Counter
from collections.abc import Container, Iterator, Sequence
from dataclasses import asdict, dataclass, fields, replace
from datetime import UTC, datetime
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

from actuator_glue.campaigns.recipe import SAID, FileRule, Recipe
from actuator_glue.errors import InputError
from actuator_glue.io.bag_reader import is_bag
from actuator_glue.io.calendar_time import calendar_time
from actuator_glue.io.channel_map import parse_channel_map
from actuator_glue.io.formats import formats
from actuator_glue.io.load import load_records
from actuator_glue.io.remarks import Note
from actuator_glue.records import Record, check_hold, check_stiffness, source_names

# How many names a message lists.
_LISTED = 3


@dataclass(frozen=True, slots=True)
class Member:
    """One file or bag of a group, and how it is read; see `FileRule`.

    Attributes:
        path: the file, absolute.
        name: its path below the folder that was given.
        held_out: it decides nothing.
        problem: why its name or table entry cannot be used; empty where they can.
    """

    path: str
    name: str
    channels: dict[str, Any] | None = None
    stiffness: float | None = None
    hold: str | None = None
    resample: float | None = None
    split: bool = False
    held_out: bool = False
    problem: str = ''

    def records(self, tell: Note | None = None) -> list[Record]:
        """Return its records.

        Args:
            tell: called with each remark on a file that can still be used.

        Raises:
            InputError: as `load_records`, or its name or table entry cannot be used.
        """
        if self.problem:
            raise InputError(f'{self.name}: {self.problem}')

        def told(line: str) -> None:
            if tell is not None:
                tell(line.replace(self.path, self.name))

        channels = None
        if self.channels is not None:
            channels = parse_channel_map(self.channels, f'{self.name}: recipe')
        return load_records(
            self.path,
            stiffness=self.stiffness,
            channels=channels,
            hold=None if self.hold is None else check_hold(self.hold, self.name),
            resample=self.resample,
            gap=told if self.split else None,
            warn=told,
        )


@dataclass(frozen=True, slots=True)
class Task:
    """What one row is made from.

    Attributes:
        group: its name, unique in a campaign.
        members: the files.
        actuator, day, specimen, started: as far as names or a table say them.
        analysis: what the recipe asks for; see `Recipe.analysis`.
    """

    group: str
    members: tuple[Member, ...]
    actuator: str | None
    day: str | None
    specimen: str | None
    started: str | None
    analysis: dict[str, Any]

    def to_json(self) -> dict[str, Any]:
        """Return an object that JSON can hold."""
        return asdict(self)

    @classmethod
    def from_json(cls, value: dict[str, Any]) -> Task:
        """Return what `to_json` wrote."""
        members = tuple(Member(**m) for m in value['members'])
        return cls(**{**value, 'members': members})


def files_below(given: Sequence[Path | str], rules: Sequence[FileRule]) -> Iterator[Member]:
    """Yield every record file and bag of files and folders, sorted, each once.

    In a folder those count whose suffix is that of a format, and those that a rule matches.

    Raises:
        InputError: nothing there, or a folder without any.
    """
    seen: set[str] = set()
    for one in map(Path, given):
        if not one.exists():
            raise InputError(f'{one}: there is no such file or folder')
        if is_bag(one) or not one.is_dir():
            found, root = [one], one.parent
        else:
            found, root = _walk(one, rules), one
        for path in found:
            whole = os.path.realpath(path)
            if whole not in seen:
                seen.add(whole)
                yield _read_as(whole, path.relative_to(root).as_posix(), rules)
        if not found:
            raise InputError(
                f'{one}: no record in this folder; known are {", ".join(formats())}, bags, and '
                'what a rule of the recipe matches'
            )


def _walk(root: Path, rules: Sequence[FileRule]) -> list[Path]:
    """Return the record files and bags of a folder and of those below it, sorted.

    Each is there once, under its shortest path, whatever links lead to it or to its folders, also
    where one leads back. What begins with a dot or, as the lock files of spreadsheets, with `~$`,
    is none.
    """
    known = formats()
    found: dict[str, Path] = {}
    gone: set[str] = set()
    level = [root]
    while level:  # folders of one depth after the other: the first path to a file is the shortest
        below: list[Path] = []
        for folder in level:
            real = os.path.realpath(folder)
            if real in gone:
                continue
            gone.add(real)
            for path in sorted(folder.iterdir(), key=_links_last):
                if path.name.startswith(('.', '~$')):
                    continue
                if is_bag(path) or (not path.is_dir() and _is_record(path, root, rules, known)):
                    found.setdefault(os.path.realpath(path), path)
                elif path.is_dir():
                    below.append(path)
        level = sorted(below, key=_links_last)
    return sorted(found.values())


def _links_last(path: Path) -> tuple[bool, Path]:
    return path.is_symlink(), path


def _is_record(path: Path, root: Path, rules: Sequence[FileRule], known: Container[str]) -> bool:
    """Whether a file has the suffix of a format, or a rule matches it."""
    name = path.relative_to(root).as_posix()
    return path.suffix.lower() in known or any(_matches(name, rule.match) for rule in rules)


def _matches(name: str, pattern: str) -> bool:
    """Whether a path below the given folder, or its last part, fits a pattern."""
    return fnmatch(name, pattern) or fnmatch(name.rpartition('/')[2], pattern)


def _read_as(path: str, name: str, rules: Sequence[FileRule]) -> Member:
    said: dict[str, Any] = {}
    for rule in rules:
        if _matches(name, rule.match):
            entries = {f.name: getattr(rule, f.name) for f in fields(rule) if f.name != 'match'}
            said |= {n: v for n, v in entries.items() if v is not None}
    return Member(path=path, name=name, **said)


def tasks_of(given: Sequence[Path | str], recipe: Recipe) -> list[Task]:
    """Return the tasks of a campaign, sorted by their group.

    Args:
        given: files, bags and folders.
        recipe: how to read and group them.

    Raises:
        InputError: as `files_below`, or a table that cannot be used.
    """
    told = {} if recipe.table is None else _read_table(Path(recipe.table))
    analysis = recipe.analysis()
    groups: dict[str, list[tuple[Member, dict[str, str]]]] = {}
    used: set[str] = set()
    found = list(files_below(given, recipe.files))
    alone = _apart(found)
    for member in found:
        entry = next((n for n in (member.name, Path(member.path).name) if n in told), None)
        used |= {entry} if entry is not None else set()
        try:
            said = _by_name(member.name, recipe.names) | told.get(entry or '', {})
            member = _with(member, said, recipe.holdout)
        except InputError as error:  # costs this file only: its row tells why
            said, member = {}, replace(member, problem=str(error))
        missing = [key for key in recipe.group if key not in said]
        if missing:
            said |= _by_itself(member, missing)
        # A file that does not say by what to group it stands alone.
        keys = [said.get(key) for key in recipe.group]
        named = '/'.join(map(str, keys)) if keys and None not in keys else alone[member.path]
        groups.setdefault(named, []).append((member, said))
    lacking = sorted(set(told) - used)
    if lacking:
        listed = ', '.join(lacking[:_LISTED])
        raise InputError(
            f'{recipe.table}: {len(lacking)} of its files are not among the records: {listed}'
        )
    return [_task(name, groups[name], analysis) for name in sorted(groups)]


def _apart(members: Sequence[Member]) -> dict[str, str]:
    """Return a name of its own for each file, by its path.

    Its name below the folder that was given; where files of several folders share that, the
    shortest end of its path that no other has.
    """
    shared = Counter(member.name for member in members)
    names = {m.path: m.name for m in members if shared[m.name] == 1}
    others = [m.path for m in members if m.path not in names]
    ends = source_names([*names.values(), *others])
    return names | {path: ends[path] for path in others}


def _with(member: Member, said: dict[str, str], holdout: str | None) -> Member:
    """Return a member with what name or table say of how it is read."""
    changes: dict[str, Any] = {}
    if 'stiffness' in said:
        try:
            changes['stiffness'] = check_stiffness(float(said['stiffness']))
        except ValueError as error:
            raise InputError(f'stiffness {said["stiffness"]!r} cannot be used: {error}') from error
    if 'hold' in said:
        changes['hold'] = check_hold(said['hold'], member.name)
    changes['held_out'] = holdout is not None and _matches(member.name, holdout)
    return replace(member, **changes)


def _task(name: str, found: list[tuple[Member, dict[str, str]]], analysis: dict[str, Any]) -> Task:
    def common(key: str) -> str | None:
        values = {said.get(key) for _, said in found}
        return values.pop() if len(values) == 1 else None

    started = min((said['started'] for _, said in found if 'started' in said), default=None)
    return Task(
        group=name,
        members=tuple(member for member, _ in found),
        actuator=common('actuator'),
        day=common('day'),
        specimen=common('specimen'),
        started=started,
        analysis=analysis,
    )


def _by_name(name: str, pattern: str | None) -> dict[str, str]:
    """Return what a file's name says; nothing where it is of another form."""
    match = None if pattern is None else re.search(pattern, name)
    return {} if match is None else _dated({k: v for k, v in match.groupdict().items() if v})


def _dated(said: dict[str, str]) -> dict[str, str]:
    """Return what is said with times in ISO 8601, and the day of the start.

    Raises:
        InputError: a time that cannot be read.
    """
    for key in ('started', 'day'):
        if key in said:
            said[key] = _iso(said[key], key == 'day')
    if 'started' in said:
        said.setdefault('day', said['started'][:10])
    return said


def _iso(text: str, day: bool) -> str:
    try:
        time = datetime.fromisoformat(text)
    except ValueError:
        raise InputError(
            f'{text!r} is no date or time of ISO 8601, as 2026-03-01, 20260301T101500 or '
            '2026-03-01 10:15:00'
        ) from None
    if time.tzinfo is not None:
        time = time.astimezone(UTC).replace(tzinfo=None)
    return time.date().isoformat() if day else time.isoformat(timespec='seconds')


def _by_itself(member: Member, keys: Sequence[str]) -> dict[str, str]:
    """Return what a file's own set-up says of actuator, day and specimen; nothing if unreadable.

    Why it cannot be read is told by its row.
    """
    try:
        first = member.records()[0]
    except InputError:
        return {}
    said = {'actuator': first.actuator}
    if moment := calendar_time(first.start_ns):
        said['day'] = moment.date().isoformat()
    if first.stiffness is not None:
        said['specimen'] = f'{first.stiffness:g} N/m'
    return {key: said[key] for key in keys if key in said}


def _read_table(path: Path) -> dict[str, dict[str, str]]:
    """Return what a table says of each file.

    Raises:
        InputError: it cannot be read, lacks `file`, has unknown columns or a file twice.
    """
    try:
        with path.open(newline='', encoding='utf-8-sig') as file:
            rows = list(csv.DictReader(file))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(f'{path}: table cannot be read ({error})') from error
    if not rows or 'file' not in rows[0]:
        raise InputError(f'{path}: a table needs a line of names with `file` among them')
    unknown = [name for name in rows[0] if name not in ('file', *SAID)]
    if unknown:
        raise InputError(
            f'{path}: unknown column {unknown[0]!r}; known are file, {", ".join(SAID)}'
        )
    found: dict[str, dict[str, str]] = {}
    for line, row in enumerate(rows, 2):
        name = (row.pop('file') or '').strip()
        if not name or name in found:
            what = f'{name} stands here again' if name else 'no file'
            raise InputError(f'{path}: line {line}: {what}; each file has one line')
        try:
            found[name] = _dated({k: v.strip() for k, v in row.items() if v and v.strip()})
        except InputError as error:
            raise InputError(f'{path}: line {line}: {error}') from error
    return found
