"""Moves on an answer are asked for in their order, and what was taken is told."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import two_sweeps

from actuator_glue.diagnosis.effort import Effort
from actuator_glue.diagnosis.moves.move import AnswerMove, follow
from actuator_glue.diagnosis.moves.registry import WITHIN
from actuator_glue.diagnosis.selection import SearchStep

WEIGHTS = {'light': -1, 'a': 1, 'b': 2, 'c': 1, 'd': 1}


@cache
def chosen(effects: tuple[str, ...]) -> Any:
    """A structure with a parameter for each effect beside four."""
    fit = SimpleNamespace(theta=np.zeros(4 + len(effects)), rms=1e-5)
    return SimpleNamespace(final=SimpleNamespace(effects=effects, fit=fit))


@dataclass(frozen=True)
class Answer:
    """Stands for a conclusion: effects found, and what each parameter leaves."""

    effects: tuple[str, ...]
    effort: Effort = field(default_factory=Effort)
    history: tuple[SearchStep, ...] = ()
    others: tuple[str, ...] = ()
    beam: Any = field(default_factory=lambda: SimpleNamespace(refits='one for all'))

    @property
    def found(self) -> Any:
        """What was chosen: the same object for the same answer."""
        return chosen(self.effects)

    def outweighs(self, other: Answer) -> bool:
        """Whether it has more weight."""
        return sum(map(WEIGHTS.get, self.effects)) > sum(map(WEIGHTS.get, other.effects))


def adding(name: str, *, when: bool = True, taken: bool = True) -> Any:
    """A move that adds an effect."""

    def make(result: Any, asking: Any) -> Any:
        return replace(result, effects=(*result.effects, name), others=()) if taken else None

    return AnswerMove(f'add {name}', lambda result: when, make)


def holding_against(row: str) -> Any:
    """A move that leaves the answer as it is, with a row of what it was held against."""
    return AnswerMove(
        'hold it against more',
        lambda result: True,
        lambda result, asking: replace(result, others=(*result.others, row)),
    )


def followed(*groups: tuple[Any, ...], effort: Effort | None = None) -> Any:
    """Return what moves come to from nothing."""
    start: Any = Answer((), effort or Effort(), (SearchStep('Eq. (2) alone', (), 4, 2e-5),))
    asking: Any = None
    return follow(start, groups, asking)


def test_of_a_group_the_heaviest_answer_is_taken_until_none_has_more_weight() -> None:
    told = followed((adding('a'), adding('b'), adding('light')), (adding('c', taken=False),))
    assert told.effects == ('b', 'a')
    assert [s.what for s in told.history] == ['Eq. (2) alone', 'add b', 'add a']
    assert [s.parameters for s in told.history] == [4, 5, 6]


def test_groups_are_tried_in_their_order() -> None:
    assert followed((adding('a'),), (adding('b'),)).effects == ('a', 'b')


def test_what_an_answer_was_held_against_stays_in_the_table() -> None:
    """No move was taken, so no step is told."""
    told = followed((holding_against('a'),))
    assert told.effects == () and len(told.history) == 1
    assert 'a' in told.others


def test_an_answer_of_less_weight_is_not_taken() -> None:
    told = followed((adding('light'),), (adding('b'),))
    assert told.effects == ('b',) and len(told.history) == 2


def test_what_is_not_asked_for_is_not_taken() -> None:
    told = followed((adding('a', when=False),), (adding('b', taken=False),))
    assert told.effects == () and len(told.history) == 1


def test_no_move_that_refits_is_begun_once_the_effort_is_spent() -> None:
    assert followed((adding('a'),), effort=Effort(0.0)).effects == ()
    known = replace(adding('a'), refits=False)
    assert followed((known,), effort=Effort(0.0)).effects == ('a',)


def test_the_steps_of_a_search_lead_to_what_it_found() -> None:
    """Play of 60 um: added to Eq. (2), which leaves more."""
    effects = {'backlash': 6e-5}
    names = ('backlash', 'delay', 'bias')
    _, found = two_sweeps.selected(names, effects, stroke=2e-3, hertz=5.0, seconds=20.0)
    steps = found.steps
    assert [s.effects for s in steps] == [(), ('backlash',)]
    assert [s.parameters for s in steps] == [4, 5]
    assert steps[0].error > 1.3 * steps[1].error
    assert steps[1].error == pytest.approx(found.final.fit.rms, rel=1e-3)


def test_what_is_known_already_is_tried_before_another_search() -> None:
    """Effort that ended in the search for reserved effects left a known description untold."""
    costly = 'effects reserved for the rest'
    (group,) = (names for moves in WITHIN if costly in (names := [m.what for m in moves]))
    assert group[-1] == costly
