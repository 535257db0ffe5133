"""What a worker does with one task: hash, look whether its row is there, compute, write."""

from __future__ import annotations

import json
import threading
import time
from datetime import UTC, datetime
from pathlib import Path

from actuator_glue import __version__
from actuator_glue.campaigns.cluster import forget_names
from actuator_glue.campaigns.grouping import Task
from actuator_glue.campaigns.record_process import RecordProcess
from actuator_glue.campaigns.rows import BETWEEN, Row, RowFolder, content, fingerprint, key_of

# The process of each of a worker's threads.
_OF_THREAD = threading.local()


def carry_out(
    value: str, folder: str, limits: tuple[float, float], analysis: str, again: bool
) -> tuple[str, bool, bool]:
    """Leave the row of a task in the folder of its campaign.

    Args:
        value: the task, JSON of `Task.to_json`.
        folder: of the campaign; every worker sees it under this path.
        limits: time [s] and memory [GB] that it may take.
        analysis: `module:function` that makes the row.
        again: rows that tell a failure are made again.

    Returns:
        The row's key, whether it failed, and whether it was computed now.
    """
    forget_names()
    task, rows = Task.from_json(json.loads(value)), RowFolder(folder)
    hashes = content(task)
    key = key_of(task, hashes)
    known = rows.read(key)
    if known is not None and not (again and known['failure']):
        if known['fingerprint'] != fingerprint(task):  # the same content at another time
            rows.write(key, {**known, 'fingerprint': fingerprint(task)})
        return key, bool(known['failure']), False
    started = time.perf_counter()
    seconds, memory_gb = limits
    found = _process(analysis, memory_gb).row(task, Path(folder), key, seconds)
    rows.write(key, row_of(task, key, hashes, found, time.perf_counter() - started))
    return key, bool(found.get('failure')), True


def row_of(task: Task, key: str, hashes: list[str], found: Row, seconds: float) -> Row:
    """Return the whole row of a task: what it was made from, what was found, how long it took."""
    return {
        'group': task.group,
        'source': BETWEEN.join(m.name for m in task.members),
        'sha256': BETWEEN.join(hashes),
        'key': key,
        'actuator': task.actuator,
        'day': task.day,
        'specimen': task.specimen,
        'started': task.started,
        'verdict': 'failed',
        'failure': '',
        **found,
        'seconds': seconds,
        'version': __version__,
        'finished': datetime.now(UTC).isoformat(timespec='microseconds'),
        'fingerprint': fingerprint(task),
    }


def _process(analysis: str, memory_gb: float) -> RecordProcess:
    held: RecordProcess | None = getattr(_OF_THREAD, 'process', None)
    if held is None or (held.analysis, held.memory_gb) != (analysis, memory_gb):
        if held is not None:
            held.close()
        held = _OF_THREAD.process = RecordProcess(analysis, memory_gb)
    return held
