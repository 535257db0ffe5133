"""Whether what is missing was not there from the beginning, and what it is then."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace

from actuator_glue.diagnosis import moments
from actuator_glue.diagnosis.data import SETTLE
from actuator_glue.diagnosis.each import Each
from actuator_glue.diagnosis.moments import Moment
from actuator_glue.diagnosis.onset import Appeared
from actuator_glue.diagnosis.pipeline import Conclusion, Progress, conclude
from actuator_glue.diagnosis.thresholds import Thresholds


def since_onset(first: Conclusion, settings: Thresholds, each: Each, tell: Progress) -> Conclusion:
    """Ask whether what is missing was not there from the beginning.

    Taken where Eq. (2), or what acts all the time, up to a moment, and what is found in the data
    since then, leave materially less than effects that act all the time.
    """
    found = first.found
    final = found.final
    if first.decision.verdict == 'none':
        return first
    if first.decision.left < found.material:
        # The answer is complete: only what it found can still have changed, and materially so.
        least = final.fit.error.size * found.material**2
        changed = moments.changes(first.data, final.fit.error, final.fit.jacobian)
        if all(removed < least for _, removed in changed):
            return first

    def search(moment: Moment) -> Conclusion:
        tell('onset', 0.0)
        return conclude(first.prepared.since(moment), settings, each, tell, fixed=True)

    best, least = first, math.inf
    for moment in _moments(first):
        told = _since(first, moment, settings, search)
        if told is None:
            continue
        if told.decision.verdict != 'unexplained':
            return told
        # Where records meet, it may be no onset but a form that is not the machine's.
        if moment.inside(first.data) and told.decision.left < least:
            best, least = told, told.decision.left
    return best


def _since(
    first: Conclusion,
    moment: Moment,
    settings: Thresholds,
    search: Callable[[Moment], Conclusion],
) -> Conclusion | None:
    """Return what is found in the data since a moment, where that explains more.

    Args:
        first: what was found in all data.
        moment: when something may have appeared.
        settings: thresholds.
        search: searches the data since a moment.
    """
    quiet = moments.quiet_before(moment, first.data)
    if quiet is None:
        return None
    second = search(moment)
    found, before = second.found, quiet[0]
    base = replace(first.found.base, fit=quiet[1])
    cost = settings.nats * 2.0 * second.decision.noise**2
    enough = moments.enough_before(before, base, found.final, cost)
    sides = before, moment.split(first.data)[1]

    def told(most: float) -> Conclusion | None:
        bare = next(trial for trial, excess in enough if excess <= most)
        nats = settings.nats + len(bare.fit.theta)
        rivals = first.found.final, bare, found.final
        if not moments.explains(sides, rivals, nats, found.material):
            return None
        return replace(second, appeared=Appeared(first.data, moment, bare))

    near = told(math.inf)
    if near is None or near.onset is None:
        return None
    onset = near.onset
    if onset.growth == 0.0 and onset.time > moment.time + SETTLE:
        # What came before it bends what is found: the data since then are its own.
        later = Moment(moment.record, onset.time)
        if other := _since(first, later, settings, search):
            return other
    return told(found.material)


def _moments(first: Conclusion) -> Iterator[Moment]:
    """Yield when something may have appeared, likelier moments first."""
    whiten, told = first.scorer.whiten, list[Moment]()
    for fit in dict.fromkeys((first.found.base.fit, first.found.final.fit)):
        error, jacobian = fit.error, fit.jacobian
        # Beside misfit what is slow counts little once it is whitened.
        for pair in ((whiten(error), whiten(jacobian)), (error, jacobian)):
            for moment, _ in moments.changes(first.data, *pair):
                if not any(moment.near(other) for other in told):
                    told.append(moment)
                    yield moment
