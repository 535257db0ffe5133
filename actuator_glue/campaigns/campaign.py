"""Campaigns: every record or group of a laboratory analysed once, a row each."""

from __future__ import annotations

import json
import math
import os
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, fields
from datetime import UTC, datetime
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any

from actuator_glue import __version__
from actuator_glue.campaigns.cluster import connected
from actuator_glue.campaigns.grouping import Task, tasks_of
from actuator_glue.campaigns.progress_file import Progress, ProgressFile
from actuator_glue.campaigns.recipe import Recipe, read_recipe
from actuator_glue.campaigns.rows import RESULTS, RowFolder, content, fingerprint, key_of, needed
from actuator_glue.campaigns.worker_task import carry_out, row_of
from actuator_glue.errors import InputError
from actuator_glue.given import of_kind, one_thing, path, whole
from actuator_glue.io.json_file import write_json
from actuator_glue.json_value import json_fields

if TYPE_CHECKING:
    from pandas import DataFrame

ANALYSIS = 'actuator_glue.campaigns.analysis:analysed'
# Tasks given to the scheduler for each thread, again when half of them have ended: a thread always
# finds its next task, and the scheduler never holds many and is asked seldom (it keeps notes).
_AHEAD = 8
# How often the number of workers is asked for [s].
_RECOUNT = 5.0
_GONE = 'the scheduler has gone, with what its workers had in hand'


@dataclass(frozen=True, slots=True)
class CampaignResult:
    """What a campaign left.

    Attributes:
        folder: where.
        progress: how it ended: rows made, known before, failed.
        table: the row of each group (pandas), as in `results.parquet`.
    """

    folder: Path
    progress: Progress
    table: DataFrame

    @property
    def results(self) -> Path:
        """The table's file."""
        return self.folder / RESULTS

    @property
    def failures(self) -> DataFrame:
        """The rows that tell why there is nothing."""
        return self.table[self.table['failure'] != '']


def campaign(
    records: Sequence[Path | str] | Path | str,
    out: Path | str,
    recipe: Recipe | Path | str | None = None,
    *,
    scheduler: str | None = None,
    workers: int | None = None,
    again: bool = False,
    progress: Callable[[Progress], None] | None = None,
    analysis: str = ANALYSIS,
) -> CampaignResult:
    """Analyse every record or group of records once, and gather a row of each.

    What was analysed already with the same content, recipe and version is not analysed again; a
    run that was ended in any way goes on with the same call. What a record does, kill its process
    or take more time or memory than the recipe allows, costs that record.

    Args:
        records: files, bags, and folders of them.
        out: folder for rows, `results.parquet`, and what the recipe asks to keep.
        recipe: how to read, group and analyse; a YAML file; None for each file by itself.
        scheduler: address of a dask scheduler whose workers see records and folder under the same
            paths; None for processes of this machine.
        workers: how many of these; None for one a core.
        again: rows that tell a failure are made again.
        progress: called every two seconds and at the end.
        analysis: `module:function` that makes a row of (task, folder, key) in place of `analysed`.

    Raises:
        InputError: recipe, records or folder that cannot be used, a library that is not there, a
            scheduler that does not answer or has gone.
    """
    for module in ('distributed', 'pandas', 'pyarrow'):
        needed(module, 'a campaign')
    if workers is not None and whole(workers, 'workers') < 1:
        raise InputError(f'workers {workers} is below 1')
    several = isinstance(records, Iterable) and not one_thing(records)
    given: list[Any] = list(records) if several else [records]  # type: ignore[arg-type]  # they are
    given = [path(one, 'records') for one in given]
    if not given:
        raise InputError('records: no record given')
    if not isinstance(recipe, Recipe):
        kinds = (str, os.PathLike, type(None))
        of_kind(recipe, 'recipe', kinds, 'a Recipe, a YAML file of one, or None')
        recipe = Recipe() if recipe is None else read_recipe(recipe)
    tasks = tasks_of(given, recipe)
    rows = RowFolder(path(out, 'out').resolve())
    try:
        rows.folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f'{out}: no folder can be made ({error.strerror})') from error
    _write_provenance(rows.folder, recipe, len(tasks), scheduler, analysis)
    run = _CampaignRun(rows, recipe, analysis, again, progress or (lambda now: None))
    return run.through(tasks, scheduler, workers)


def _write_provenance(
    folder: Path, recipe: Recipe, groups: int, scheduler: str | None, analysis: str
) -> None:
    content = {
        'schema': 'actuator_glue.campaign/1',
        'version': f'actuator_glue {__version__}',
        'date': datetime.now(UTC).isoformat(timespec='seconds'),
        'command': sys.argv,
        'groups': groups,
        'scheduler': scheduler or 'this machine',
        'analysis': analysis,
        'recipe': {f.name: getattr(recipe, f.name) for f in fields(recipe) if f.name != 'files'}
        | {'files': [json_fields(rule) for rule in recipe.files]},
    }
    write_json(content, str(folder / 'campaign.json'))


class _EndedError(InputError):
    """The scheduler has ended before the campaign; rows that were made are there."""


@dataclass(frozen=True, slots=True)
class _CampaignRun:
    rows: RowFolder
    recipe: Recipe
    analysis: str
    again: bool
    tell: Callable[[Progress], None]

    def through(
        self, tasks: list[Task], scheduler: str | None, workers: int | None
    ) -> CampaignResult:
        """Have every task computed that has no row yet."""
        before = {
            row['fingerprint']: (key, bool(row['failure']))
            for key, row in self.rows.all()
            if not (self.again and row['failure'])
        }
        keys: dict[str, str] = {}
        left, failed = [], 0
        for task in tasks:
            known = before.get(fingerprint(task))
            if known is None:
                left.append(task)
            else:
                keys[task.group] = known[0]
                failed += known[1]
        begin = Progress('running', len(tasks), known=len(keys), failed=failed)
        with ProgressFile(self.rows.folder, begin, self.tell) as told:
            if left:
                count = None if workers is None else min(workers, len(left))
                try:
                    with connected(scheduler, count) as client:
                        suspects = self._compute(client, left, keys, told)
                        # Whatever ended their workers was one of those: now each is by itself.
                        self._compute(client, suspects, keys, told, alone=True)
                except _EndedError as error:
                    held = ''
                    if told.now.done:
                        self.rows.gather(keys)
                        held = f', which {self.rows.folder / RESULTS} holds'
                    raise InputError(
                        f'{error}; {told.now.done} of {told.now.total} groups have their rows'
                        f'{held}: run the same command again, and it makes the others'
                    ) from error
            table = self.rows.gather(keys)
        return CampaignResult(self.rows.folder, told.now, table)

    def _compute(
        self,
        client: Any,
        tasks: list[Task],
        keys: dict[str, str],
        told: ProgressFile,
        alone: bool = False,
    ) -> list[Task]:
        """Have tasks computed, many at a time or each alone; return those that no worker outlived.

        Alone, such a task has a row that says so.
        """
        suspects: list[Task] = []
        ended: SimpleQueue[Any] = SimpleQueue()
        flying: dict[Any, Task] = {}
        name = f'campaign-{os.urandom(6).hex()}'
        room, counted, following = 0, -math.inf, 0
        while following < len(tasks) or flying:
            if time.monotonic() - counted > _RECOUNT:
                threads = _threads(client)
                room, counted = 1 if alone else _AHEAD * threads, time.monotonic()
            if following < len(tasks) and len(flying) <= room // 2:
                new = tasks[following : following + room - len(flying)]
                futures = client.map(
                    carry_out,
                    # A text each: dask looks through anything else for tasks.
                    [json.dumps(task.to_json()) for task in new],
                    key=[(name, i) for i in range(following, following + len(new))],
                    pure=False,
                    folder=str(self.rows.folder),
                    limits=(self.recipe.seconds, self.recipe.memory_gb),
                    analysis=self.analysis,
                    again=self.again,
                )
                following += len(new)
                flying |= {f.key: task for f, task in zip(futures, new, strict=True)}
                for future in futures:
                    future.add_done_callback(ended.put)
            done = {f.key: f for f in _ended(ended)}
            # One question for all that ended meanwhile: the more workers, the fewer a task.
            answers = self._answers(client, done)
            for key, future in done.items():
                task = flying.pop(key)
                answer = answers.get(key)
                if answer is None:
                    self._check(future)
                    if not alone:
                        suspects.append(task)
                        future.release()
                        continue
                    answer = self._lost(task)
                future.release()
                row, bad, computed = answer
                keys[task.group] = row
                told.add(computed=computed, failed=bad)
        return suspects

    def _answers(self, client: Any, done: dict[Any, Any]) -> dict[Any, tuple[str, bool, bool]]:
        """Return what `carry_out` said of the tasks that it did."""
        finished = {key: f for key, f in done.items() if f.status == 'finished'}
        return client.gather(finished, errors='skip') if finished else {}

    def _check(self, future: Any) -> None:
        """Check that a task without a result is one that no worker outlived.

        Raises:
            _EndedError: the scheduler has gone.
            InputError: a worker cannot write to the folder.
        """
        if future.status != 'error':
            raise _EndedError(_GONE)
        error = future.exception()
        if type(error).__name__ != 'KilledWorker':
            raise InputError(
                f'a worker cannot do its part ({type(error).__name__}: {error}); it needs this '
                f'version of actuator_glue, and {self.rows.folder} under the same path'
            ) from error

    def _lost(self, task: Task) -> tuple[str, bool, bool]:
        """Return what `carry_out` would say, a row written in its place."""
        hashes = content(task)
        key = key_of(task, hashes)
        found = {'failure': 'every worker that was given it ended'}
        self.rows.write(key, row_of(task, key, hashes, found, 0.0))
        return key, True, True


def _threads(client: Any) -> int:
    """Return how many threads the workers have, one at least.

    Raises:
        _EndedError: the scheduler has gone.
    """
    try:
        return max(sum(map(int, client.nthreads().values())), 1)
    except OSError as error:
        raise _EndedError(_GONE) from error


def _ended(queue: SimpleQueue[Any]) -> list[Any]:
    """Return what has ended, after a wait for the first of it; nothing if none comes."""
    found: list[Any] = []
    try:
        found.append(queue.get(timeout=_RECOUNT))
        while True:
            found.append(queue.get_nowait())
    except Empty:
        return found
