"""The stages of a diagnosis: their names, in order, and the share of the whole that is done."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal, TypeAlias

from actuator_glue.diagnosis.effort import Effort

Stage: TypeAlias = Literal[
    'check',
    'base fit',
    'effect 1',
    'effect 2',
    'effect 3',
    'effect 4',
    'effect 5',
    'effect 6',
    'weighing',
    'rivals',
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
# Share of the time of a diagnosis at which each stage begins: where Eq. (2) leaves nothing that
# matters, where it leaves something, and where that is more than one effect. The first stages come
# before that is known. Set with 48 machines; how well they tell the time left of others stands in
# docs/scores.md. Where a search begins again they tell it least well.
_NOTHING: dict[Stage, float] = {
    'check': 0.0,
    'base fit': 0.13,
    'effect 1': 0.36,
    'weighing': 0.5,
    'rivals': 0.64,
    'posterior before': 0.79,
    'held-out': 0.87,
    'done': 1.0,
}
_ONE: dict[Stage, float] = {
    'check': 0.0,
    'base fit': 0.13,
    'effect 1': 0.19,
    'weighing': 0.28,
    'rivals': 0.33,
    'learned term': 0.49,
    'posterior before': 0.75,
    'posterior': 0.81,
    'held-out': 0.91,
    'done': 1.0,
}
_SEVERAL: dict[Stage, float] = _ONE | {
    'effect 2': 0.28,
    'effect 3': 0.3,
    'effect 4': 0.34,
    'effect 5': 0.46,
    'effect 6': 0.52,
    'rivals': 0.56,
    'learned term': 0.67,
    'posterior before': 0.76,
    'posterior': 0.88,
    'held-out': 0.95,
}
# Stages of a search; after any other, these are of a further one, which goes on to the posterior.
_SEARCH: tuple[Stage, ...] = ('check', 'base fit', 'weighing', *EFFECTS)
_LAST: tuple[Stage, ...] = ('posterior before', 'posterior', 'held-out', 'done')
# Effort of a stage that does not tell its share, over that of the first stage.
_USUAL = 0.8


class ShareDone:
    """The share of a diagnosis that is done, which never falls; unknown labels do no harm.

    A further search (with another hold, or since an onset) is taken to last as long as all before.

    Attributes:
        effort: of the search.
        now: the stage that was told last, and the share of it that is done.
    """

    def __init__(self, effort: Effort) -> None:
        self.effort = effort
        self.now: tuple[Stage, float] = ('check', 0.0)
        self._begun, self._first, self._done = 0, 0, 0.0
        self._several = self._ended = self._further = False
        self._planned = True
        self._span = 0.0, 0.0

    def __call__(self, stage: Stage, share: float) -> float:
        """Take the share of a stage that is done, in [0, 1]; return that of the whole."""
        if stage != self.now[0] or stage == 'check':
            self._enter(stage)
        self.now = stage, share
        usual = self._begun if self._further else _USUAL * self._first
        spent = (self.effort.spent - self._begun) / (usual or self.effort.most)
        begin, end = self._span
        inner = min(max(share, spent, 0.0) if self._planned else spent, 1.0)
        self._done = max(self._done, begin + inner * (end - begin))
        return self._done

    def _enter(self, stage: Stage) -> None:
        before = self.now[0]
        if before == EFFECTS[0] and not self._first:
            self._first = self.effort.spent
        self._several |= stage in EFFECTS[1:]
        self._ended |= stage not in _SEARCH
        if self._further and stage not in _LAST:
            return
        self._further = self._ended and stage in _SEARCH
        self._begun, plan = self.effort.spent, self._plan()
        self._planned = stage in plan and not self._further
        if self._planned:
            begin = plan[stage]
            self._span = begin, min((v for v in plan.values() if v > begin), default=1.0)
        else:  # a move that is seldom made, or a further search
            self._span = self._done, max(self._done, plan['posterior before'])

    def _plan(self) -> dict[Stage, float]:
        if self._several:
            return _SEVERAL
        return _NOTHING if self.effort.missing is False else _ONE
