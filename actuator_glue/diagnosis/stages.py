"""The stages of a diagnosis: their names, in order, and the share of the work done before each."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal, TypeAlias

Stage: TypeAlias = Literal[
    'check',
    'base fit',
    'effect 1',
    'effect 2',
    'effect 3',
    'effect 4',
    'effect 5',
    'effect 6',
    'one record',
    'other hold',
    'onset',
    'learned term',
    'two effects',
    'posterior before',
    'posterior',
    'held-out',
    'done',
]
Progress: TypeAlias = Callable[[Stage, float], None]

EFFECTS: tuple[Stage, ...] = (
    'effect 1',
    'effect 2',
    'effect 3',
    'effect 4',
    'effect 5',
    'effect 6',
)
# Roughly: which searches follow the first is not known before its end.
_BEFORE: dict[Stage, float] = {
    'check': 0.0,
    'base fit': 0.01,
    'effect 1': 0.05,
    'effect 2': 0.35,
    'effect 3': 0.5,
    'effect 4': 0.6,
    'effect 5': 0.65,
    'effect 6': 0.7,
    'one record': 0.735,
    'other hold': 0.738,
    'onset': 0.741,
    'learned term': 0.744,
    'two effects': 0.747,
    'posterior before': 0.75,
    'posterior': 0.78,
    'held-out': 0.95,
    'done': 1.0,
}


class ShareDone:
    """The share of a diagnosis that is done, which never falls; unknown labels do no harm."""

    def __init__(self) -> None:
        self._done = 0.0

    def __call__(self, stage: str, share: float) -> float:
        """Take the share of a stage that is done, in [0, 1]; return that of the whole."""
        begin = next((v for name, v in _BEFORE.items() if name == stage), self._done)
        end = min((v for v in _BEFORE.values() if v > begin), default=1.0)
        self._done = max(self._done, begin + min(max(share, 0.0), 1.0) * (end - begin))
        return self._done
