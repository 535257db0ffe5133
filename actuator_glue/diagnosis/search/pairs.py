"""Pairs of effects as rivals of a single one.

A payload that brings damping of its own moves as a damper and a lag do together. No single effect
in its place does so, and a search that goes on from the payload never comes to the two. A pair
has two parameters at least, so only effects with as many have pairs as rivals that are no richer.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from actuator_glue.diagnosis.finding import BESIDE
from actuator_glue.diagnosis.learned.term import is_learned
from actuator_glue.diagnosis.refits.candidates import FAULTS, FEEDBACK
from actuator_glue.diagnosis.refits.refits import Refits
from actuator_glue.diagnosis.search.judge import Judge
from actuator_glue.diagnosis.trial import Trial


def rivals(
    refits: Refits,
    name: str,
    trials: Sequence[Trial],
    most: int,
    below: float,
    complete: bool,
) -> list[Trial]:
    """Refit the most promising pairs that have no more parameters than an effect.

    Args:
        refits: what refits.
        name: the effect.
        trials: structures with one other effect in its place.
        most: trials that are extended to pairs, and pairs that are refitted, at most.
        below: mean squared error that a rival leaves at most [m^2].
        complete: whether nothing material is left: else no names replace a description.
    """
    room = len(refits.entries[name].parameters)
    described = is_learned(refits.entries[name])
    if room < 2 or (described and not complete):
        return []
    wanted = screened(refits, name, trials[:most], room, below)[:most]
    # A fault has another size inside of the loop, so screening outside of it is misleading.
    wanted += [(t, FEEDBACK) for t in trials if t.added in FAULTS and FEEDBACK not in t.effects]

    def refitted(pair: tuple[Trial, str]) -> Trial:
        first, other = pair
        trial = refits.add(first, other)
        trial = refits.polish(trial) if trial.mean_square < below else trial
        return replace(trial, added=f'{first.added}{BESIDE}{other}')

    return list(refits.each(refitted, wanted))


def both_worth(judge: Judge, pair: Trial) -> bool:
    """Whether each effect of a pair is significant given the other; True for a single effect."""
    names = pair.added.split(BESIDE)
    if len(names) == 1:
        return True
    refits = judge.refits
    rests = list(refits.each(lambda name: refits.without(pair, name), names))
    return all(judge.better(pair, rest, 0.0) for rest in rests)


def screened(
    refits: Refits, name: str, trials: Sequence[Trial], room: int, below: float
) -> list[tuple[Trial, str]]:
    """Sort pairs by the error that starting sizes of the second effect leave, given the first.

    They are simulated at the refit with the first one, whose lag is not that of Eq. (2).

    Args:
        refits: simulates them.
        name: an effect that is in no pair.
        trials: structures with the first one.
        room: parameters of a pair, at most.
        below: mean squared error of those returned, at most [m^2].
    """
    size = {n: len(e.parameters) for n, e in refits.entries.items()}
    wanted = [
        (trial, other)
        for trial in trials
        for other in refits.names
        if other not in (name, *trial.effects) and size[trial.added] + size[other] <= room
    ]

    def left(pair: tuple[Trial, str]) -> float:
        return (1.0 - refits.promises.screen(*pair, beside=True)[0]) * pair[0].mean_square

    errors = list(refits.each(left, wanted))
    best: dict[frozenset[str], tuple[Trial, str]] = {}
    for i in np.argsort(errors, kind='stable'):
        if errors[i] < below:
            best.setdefault(frozenset((wanted[i][0].added, wanted[i][1])), wanted[i])
    return list(best.values())
