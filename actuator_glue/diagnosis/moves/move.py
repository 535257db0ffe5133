"""A move: another answer that may take the place of the one so far."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TypeAlias

from actuator_glue.diagnosis.samples.preparation import Prepared
from actuator_glue.diagnosis.search.beam_search import BeamSearch
from actuator_glue.diagnosis.search.conclusion import Conclusion
from actuator_glue.diagnosis.selection import SearchStep, Selection
from actuator_glue.diagnosis.stages import Progress
from actuator_glue.diagnosis.thresholds import Thresholds


@dataclass(frozen=True)
class Asking:
    """What moves work with.

    Attributes:
        settings: what a caller may set.
        tell: takes progress.
        conclude: searches records from the beginning, with the counted samples fixed.
    """

    settings: Thresholds
    tell: Progress
    conclude: Callable[[Prepared], Conclusion]


@dataclass(frozen=True)
class AnswerMove:
    """A further search from an answer.

    Attributes:
        what: what it does, for people.
        when: whether it is tried on an answer.
        make: returns another answer, told where it has more weight; None, or the same with more
            rows, where there is none.
        each_time: whether it is tried again on the same answer when a machine has more data.
        refits: whether it refits further structures; else it is tried where the effort is spent,
            too.
    """

    what: str
    when: Callable[[Conclusion], bool]
    make: Callable[[Conclusion, Asking], Conclusion | None]
    each_time: bool = True
    refits: bool = True

    def made(self, result: Conclusion, asking: Asking) -> Conclusion | None:
        """Return another answer; None where this one stands, now or already with fewer data."""
        if self.each_time:
            return self.make(result, asking)
        effects, samples = frozenset(result.found.final.effects), result.data.target.size
        if result.effort.earlier.would_refuse(self.what, effects, samples):
            return None
        other = self.make(result, asking)
        if other is None or other.found is result.found:
            result.effort.remembered.refused[self.what, effects] = samples
        return other


Groups: TypeAlias = tuple[tuple[AnswerMove, ...], ...]


def follow(result: Conclusion, groups: Groups, asking: Asking) -> Conclusion:
    """Take the heaviest answer of a group of moves, until none has more weight; then the next.

    Args:
        result: the answer so far.
        groups: moves, in the order in which they are tried.
        asking: what they work with.

    Returns:
        The last answer; each move that was taken is in its history. None that refits is begun once
        the effort is spent.
    """
    for group in groups:
        moves = list(group)
        while moves:
            taken, heaviest = None, result
            for move in moves:
                if (move.refits and result.effort.over) or not move.when(result):
                    continue
                other = move.made(result, asking)
                if other is None:
                    continue
                if other.found is not result.found and other.outweighs(heaviest):
                    taken, heaviest, other = move, other, heaviest
                heaviest = beside(heaviest, other)
            if taken is None:
                result = heaviest
                break
            result = after(result, heaviest, taken.what)
            moves.remove(taken)
    return result


def after(before: Conclusion, result: Conclusion, what: str) -> Conclusion:
    """Return an answer with the history, and the rows, of the one that it replaces."""
    step = SearchStep.to(result.found.final, what)
    return beside(replace(result, history=(*before.history, step)), before)


def beside(result: Conclusion, other: Conclusion) -> Conclusion:
    """Return an answer with the rows of another one that it was compared with."""
    if other.beam.refits is result.beam.refits:
        return replace(result, others=(*result.others, *other.others))
    return replace(result, others=(*result.others, *other.rows()))


def always(result: Conclusion) -> bool:
    """True, whatever the answer is."""
    return True


def as_given(result: Conclusion) -> bool:
    """Whether all data count, not only those since an onset."""
    return result.appeared is None


def complete(result: Conclusion) -> bool:
    """Whether effects explain all that matters."""
    return result.decision.verdict == 'missing-effect'


def unexplained(result: Conclusion) -> bool:
    """Whether more is left than effects may leave."""
    return result.decision.verdict == 'unexplained'


def described(result: Conclusion) -> bool:
    """Whether the search ended because one learned term leaves nothing material."""
    return unexplained(result) and result.found.described


def left(result: Conclusion) -> bool:
    """Whether something material is left, and no record has a setting of its own."""
    return (unexplained(result) or not result.leaves_nothing) and without_own(result)


def without_own(result: Conclusion) -> bool:
    """Whether no record has a setting of its own."""
    return result.found.final.own is None


def to(
    ask: Callable[[BeamSearch, Selection], Selection | None],
) -> Callable[[Conclusion, Asking], Conclusion | None]:
    """Return a move to another selection of effects, if there is one."""

    def make(result: Conclusion, asking: Asking) -> Conclusion | None:
        beam = result.beam.apart()  # it takes the noise anew
        found = ask(beam, result.found)
        return None if found is None else result.of(beam, found)

    return make
