"""The simplest of the structures that the records cannot tell apart: it is told."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from actuator_glue.diagnosis import pairs, ranking
from actuator_glue.diagnosis.finding import Rival
from actuator_glue.diagnosis.judge import Judge
from actuator_glue.diagnosis.learned.term import is_learned
from actuator_glue.diagnosis.trial import Trial


def instead(
    judge: Judge,
    current: Trial,
    rivals: Mapping[str, Sequence[Rival]],
    complete: bool,
) -> Trial:
    """Take a rival that these data cannot tell from a member: simpler, or names for it.

    Args:
        judge: what judges.
        current: the structure.
        rivals: of each member, best first.
        complete: whether it leaves nothing material.

    Returns:
        The structure with the rival in the member's place; the same object where there is none.
    """
    for name, row in rivals.items():
        two = [r for r in row if len(r.effects) > 1 and is_learned(judge.search.entries[name])]
        one = [r for r in row if len(r.effects) == 1 and r.name != name]
        for rival in (*one, *sorted(two, key=lambda r: -r.weight)):
            if not (rival.tied and _says_the_same(judge, current, name, rival, complete)):
                continue
            others = (n for n in current.effects if n != name)
            trial = judge.search.trial((*others, *rival.effects), rival.name)
            if len(rival.effects) == 1 or pairs.both_worth(judge, trial):
                return trial
    return current


def _says_the_same(judge: Judge, current: Trial, name: str, rival: Rival, complete: bool) -> bool:
    """Whether a rival is simpler and as good, or names what is described."""
    search, settings, material = judge.search, judge.settings, judge.material
    size = {n: len(search.entries[n].parameters) for n in (name, *rival.effects)}
    fewer = sum(size[n] for n in rival.effects) < size[name]
    alike = complete and rival.nats < settings.tie_nats
    alike = alike or ranking.pressed_form(search, current, name, rival.name)
    named = is_learned(search.entries[name]) and rival.excess < material
    named = named and not ranking.stays(search, settings, name, rival, material)
    return named or (fewer and alike)
