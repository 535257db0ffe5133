"""How far a campaign is, in a file of its folder that another terminal reads."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from actuator_glue.errors import InputError
from actuator_glue.io.json_file import write_json

NAME = 'progress.json'
# How often it is written while records are computed [s].
_EVERY = 2.0
# Without news for so long the campaign has been killed, or its disk is gone [s].
STALE = 60.0


@dataclass(frozen=True, slots=True)
class Progress:
    """How far a campaign is.

    Attributes:
        state: 'running', 'finished' or 'interrupted'.
        total: groups.
        known: of them, those whose row was there before.
        computed: rows made in this run.
        failed: rows that tell why there is nothing, old ones included.
        started, updated: Unix times [s].
        left_s: time left at the pace so far [s]; None before the first row.
    """

    state: str
    total: int
    known: int = 0
    computed: int = 0
    failed: int = 0
    started: float = 0.0
    updated: float = 0.0
    left_s: float | None = None

    @property
    def done(self) -> int:
        """Groups that have their row."""
        return self.known + self.computed

    def line(self, now: float) -> str:
        """Return it for people; `now` is the Unix time [s]."""
        told = f'{self.state}: {self.done} of {self.total} groups, {self.failed} failed'
        if self.known:
            told += f', {self.known} known before'
        if self.state != 'running':
            return told
        if self.left_s is not None:
            told += f', {duration_said(self.left_s)} left'
        if now - self.updated > STALE:
            told += (
                f'; no news for {duration_said(now - self.updated)}: it was killed, or cannot '
                'write; the same command goes on where it ended'
            )
        return told


def duration_said(seconds: float) -> str:
    """Return a time for people, as `2 h 05 min`."""
    whole = round(seconds)
    if whole < 90:
        return f'{whole} s'
    if whole < 5400:
        return f'{round(whole / 60)} min'
    hours, rest = divmod(whole, 3600)
    return f'{hours} h {rest // 60:02d} min'


class ProgressFile:
    """Keeps the progress of a running campaign in its folder; use it with `with`.

    Args:
        folder: of the campaign.
        progress: at the beginning.
        tell: called with it whenever it is written.
        clock: Unix time [s].
    """

    def __init__(
        self,
        folder: Path,
        progress: Progress,
        tell: Callable[[Progress], None],
        clock: Callable[[], float] = time.time,
    ) -> None:
        self._path, self._tell, self._clock = folder / NAME, tell, clock
        self._now = replace(progress, started=clock())
        self._lock, self._ended = threading.Lock(), threading.Event()
        self._thread = threading.Thread(target=self._keep, daemon=True, name='progress')

    def add(self, *, computed: bool, failed: bool) -> None:
        """Count one row."""
        with self._lock:
            now = self._now
            computed_rows, known = now.computed + computed, now.known + (not computed)
            left = None
            if computed_rows:
                pace = (self._clock() - now.started) / computed_rows
                left = pace * (now.total - known - computed_rows)
            self._now = replace(
                now,
                computed=computed_rows,
                known=known,
                failed=now.failed + failed,
                left_s=left,
            )

    @property
    def now(self) -> Progress:
        """The progress by now."""
        return self._now

    def __enter__(self) -> ProgressFile:
        self._write()
        self._thread.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self._ended.set()
        self._thread.join()
        state = 'finished' if kind is None else 'interrupted'
        with self._lock:
            self._now = replace(self._now, state=state, left_s=None)
        self._write()

    def _keep(self) -> None:
        while not self._ended.wait(_EVERY):
            self._write()

    def _write(self) -> None:
        with self._lock:
            self._now = replace(self._now, updated=self._clock())
            now = self._now
        write_json(asdict(now), str(self._path))
        self._tell(now)


def read_progress(folder: Path | str) -> Progress:
    """Return how far a campaign is.

    Raises:
        InputError: no campaign has run there.
    """
    path = Path(folder) / NAME
    try:
        return Progress(**json.loads(path.read_text('utf-8')))
    except (OSError, ValueError, TypeError) as error:
        raise InputError(
            f'{folder}: no campaign has run in this folder ({NAME} cannot be read)'
        ) from error
