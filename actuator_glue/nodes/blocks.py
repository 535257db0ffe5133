"""Records and plants to a stream of SampleBlock, TestSetup and CommandPreview messages."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from actuator_glue.motion import METRES
from actuator_glue.nodes import topics
from actuator_glue.nodes.messages import publish
from actuator_glue.online.conversion import Fields, Head
from actuator_glue.records import Array, Hold


class BlockPublisher:
    """Publishes one actuator's samples with a running index and strictly increasing stamps.

    Args:
        make: makes a publisher for a topic.
    """

    def __init__(self, make: Callable[[topics.Topic], Any]) -> None:
        self._samples = make(topics.SAMPLES)
        self._setup = make(topics.TEST_SETUP)
        self._preview = make(topics.PREVIEW)

    def begin(self, actuator: str, period: float, start_ns: int, first_index: int = 0) -> None:
        """Start a stream whose first sample has this time and index."""
        self.actuator, self.period = actuator, period
        self._start_ns, self._first = start_ns, first_index

    def stamp_ns(self, index: int) -> int:
        """Acquisition time of a sample [ns]."""
        return self._start_ns + round((index - self._first) * self.period * 1e9)

    def setup(
        self,
        stiffness: float | None,
        hold: Hold,
        index: int,
        source: str,
        motion: str = METRES,
    ) -> None:
        """Announce the test set-up that holds from a sample on."""
        fields: Fields = {
            'actuator': self.actuator,
            'specimen_stiffness': float('nan') if stiffness is None else float(stiffness),
            'rate': 1.0 / self.period,
            'hold': hold,
            'index': index,
            'source': source,
            'motion': motion,
        }
        publish(self._setup, Head(self.stamp_ns(index), self.actuator), fields)

    def samples(self, index: int, command: Array, measured: Array, force: Array | None) -> None:
        """Publish consecutive samples."""
        fields: Fields = {
            'period': self.period,
            'index': index,
            'command': np.ascontiguousarray(command),
            'measured': np.ascontiguousarray(measured),
            'force': np.empty(0) if force is None else np.ascontiguousarray(force),
        }
        publish(self._samples, Head(self.stamp_ns(index), self.actuator), fields)

    def preview(self, index: int, command: Array) -> None:
        """Publish commands that samples from `index` on will carry."""
        fields: Fields = {
            'period': self.period,
            'index': index,
            'command': np.ascontiguousarray(command),
        }
        publish(self._preview, Head(self.stamp_ns(index), self.actuator), fields)
