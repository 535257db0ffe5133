"""The last minutes of a stream as records, one per stretch without a break."""

from __future__ import annotations

from collections import deque
from dataclasses import replace

import numpy as np

from actuator_glue.online.settings import EstimatorSettings
from actuator_glue.online.stream import Event, Window
from actuator_glue.online.windows import SlidingWindows
from actuator_glue.records import Record
from actuator_glue.sample_block import Block
from actuator_glue.setups import StreamSetup

PIECE = 0.5  # s; what is kept ends at most this long before the last sample


class Collector:
    """Keeps what was streamed lately; a bounded number of seconds, whatever happens.

    Args:
        seconds: how much is kept [s].
    """

    def __init__(self, seconds: float) -> None:
        self.seconds = seconds
        pieces = EstimatorSettings(window=PIECE, hop=PIECE, settle=0.0, time_budget=PIECE)
        self._windows = SlidingWindows(pieces)
        self._kept: deque[Window] = deque(maxlen=max(1, round(seconds / PIECE)))
        self._pieces = 0

    @property
    def received(self) -> float:
        """Usable data since the stream began, including data no longer kept [s]."""
        return self._pieces * PIECE

    @property
    def first_ns(self) -> int | None:
        """Acquisition time of the first sample that is kept [ns]; None where none is."""
        return self._kept[0].record.start_ns if self._kept else None

    @property
    def unused(self) -> str:
        """Why the samples that come now are not kept; empty where they are, or none came."""
        return self._windows.unused

    def setup(self, setup: StreamSetup) -> list[Event]:
        """Take a test set-up."""
        return self._windows.setup(setup)

    def push(self, block: Block) -> list[Event]:
        """Take a block of samples."""
        events, windows = self._windows.push(block)
        if windows and self._kept and windows[0].epoch != self._kept[-1].epoch:
            self.forget()  # another actuator
        # In a piece's record there is all that is kept.
        self._kept.extend(replace(window, stretch=None) for window in windows)
        self._pieces += len(windows)
        return events

    def forget(self) -> None:
        """Let go of everything kept."""
        self._kept.clear()
        self._pieces = 0

    def records(self, shortest: float = 5.0, since: float = 0.0) -> list[Record]:
        """Return what is kept, oldest first.

        Args:
            shortest: stretches shorter than this are left out [s].
            since: data at the stream's start that are left out, too [s].
        """
        stretches: dict[int, list[Record]] = {}
        wanted = max(0, self._pieces - round(since / PIECE))
        for window in list(self._kept)[max(0, len(self._kept) - wanted) :]:
            stretches.setdefault(window.segment, []).append(window.record)
        joined = [_join(parts) for parts in stretches.values()]
        return [r for r in joined if r.duration >= shortest - 1e-9]


def _join(parts: list[Record]) -> Record:
    return replace(
        parts[0],
        command=np.concatenate([p.command for p in parts]),
        measured=np.concatenate([p.measured for p in parts]),
        source=f'{parts[0].actuator}, samples {parts[0].first_index}..',
    )
