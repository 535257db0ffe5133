"""Campaigns: every record or group of a laboratory analysed once, a row each."""

from __future__ import annotations

import math
import os
import sys
import time
from collections.abc import Callable, Sequence
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
from actuator_glue.io.json_file import write_json
from actuator_glue.json_value import json_fields

if TYPE_CHECKING:
    from pandas import DataFrame

ANALYSIS = 'actuator_glue.campaigns.analysis:analysed'
# Tasks given to the scheduler for each thread: the next are there when one ends, and it never
# knows of many.
_AHEAD = 4
# How often the number of workers is asked for [s].
_RECOUNT = 5.0


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
    if workers is not None and workers < 1:
        raise InputError(f'workers {workers} is below 1')
    given = [records] if isinstance(records, (str, os.PathLike)) else list(records)
    if not isinstance(recipe, Recipe):
        recipe = Recipe() if recipe is None else read_recipe(recipe)
    tasks = tasks_of(given, recipe)
    rows = RowFolder(Path(out).resolve())
    try:
        rows.folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f'{out}: no folder can be made ({error.strerror})') from error
    _write_provenance(rows.folder, recipe, len(tasks), scheduler, analysis)
    run = _CampaignRun(rows, recipe, analysis, again, progress or _untold)
    return run.through(tasks, scheduler, workers)


def _untold(progress: Progress) -> None:
    """Tell nobody."""


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
                with connected(scheduler, count) as client:
                    self._compute(client, left, keys, told)
            table = self.rows.gather(keys)
        return CampaignResult(self.rows.folder, told.now, table)

    def _compute(
        self, client: Any, tasks: list[Task], keys: dict[str, str], told: ProgressFile
    ) -> None:
        ended: SimpleQueue[Any] = SimpleQueue()
        flying: dict[Any, Task] = {}
        name = f'campaign-{os.urandom(6).hex()}'
        room, counted, following = 0, -math.inf, 0
        while following < len(tasks) or flying:
            if time.monotonic() - counted > _RECOUNT:
                room, counted = _AHEAD * max(sum(client.nthreads().values()), 1), time.monotonic()
            while following < len(tasks) and len(flying) < room:
                task = tasks[following]
                future = client.submit(
                    carry_out,
                    task.to_json(),
                    str(self.rows.folder),
                    (self.recipe.seconds, self.recipe.memory_gb),
                    self.analysis,
                    self.again,
                    key=(name, following),
                    pure=False,
                )
                flying[future.key] = task
                future.add_done_callback(ended.put)
                following += 1
            try:
                future = ended.get(timeout=_RECOUNT)
            except Empty:
                continue
            task = flying.pop(future.key)
            key, bad, computed = self._outcome(future, task)
            future.release()
            keys[task.group] = key
            told.add(computed=computed, failed=bad)

    def _outcome(self, future: Any, task: Task) -> tuple[str, bool, bool]:
        """Return what `carry_out` did; a row of its own where no worker outlived the task.

        Raises:
            InputError: the scheduler has gone, or a worker cannot write to the folder.
        """
        if future.status == 'finished':
            done: tuple[str, bool, bool] = future.result()
            return done
        if future.status != 'error':
            raise InputError(
                'the scheduler has gone, with what its workers had in hand; rows that were made '
                'are kept: run the same command again'
            )
        error = future.exception()
        if type(error).__name__ != 'KilledWorker':
            raise InputError(
                f'a worker cannot do its part ({type(error).__name__}: {error}); it needs this '
                f'version of actuator_glue, and {self.rows.folder} under the same path'
            ) from error
        hashes = content(task)
        key = key_of(task, hashes)
        found = {'failure': 'every worker that was given it ended'}
        self.rows.write(key, row_of(task, key, hashes, found, 0.0))
        return key, True, True
