"""Effects that start mid-record: when, and which they are."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace

from actuator_glue.diagnosis.moves.learned_terms import LEARNED_TERMS
from actuator_glue.diagnosis.moves.move import Asking, follow
from actuator_glue.diagnosis.scopes import moments
from actuator_glue.diagnosis.scopes.moments import Moment
from actuator_glue.diagnosis.scopes.onset import Appeared
from actuator_glue.diagnosis.search.conclusion import Conclusion
from actuator_glue.inference.least_squares.data import SETTLE, Data
from actuator_glue.inference.least_squares.fit import Fit

Quiet = tuple[Data, Fit]
_OTHERS = 2  # moments at most that are tried though Eq. (2) is not enough before them


def since_onset(first: Conclusion, asking: Asking) -> Conclusion | None:
    """Detect effects that start mid-record.

    Effects are found in the data since a moment; Eq. (2), or effects that always act, hold before.
    """
    since = _appeared(first, asking)
    return None if since is None else follow(since, LEARNED_TERMS, asking)


def _appeared(first: Conclusion, asking: Asking) -> Conclusion | None:
    found = first.found
    final = found.final
    if first.decision.verdict == 'none' or first.appeared is not None:
        return None
    if first.decision.left < found.material:
        # The answer is complete: an onset is possible only if its effects changed materially.
        least = final.fit.error.size * found.material**2
        changed = moments.changes(first.data, final.fit.error, final.fit.jacobian)
        if all(removed < least for _, removed in changed):
            return None

    def conclude_since(moment: Moment) -> Conclusion:
        asking.tell('onset', 0.0)
        return asking.conclude(first.prepared.since(moment))

    best, least = None, math.inf
    for moment, quiet in _asked(first):
        if first.effort.over:
            break
        told = _since(first, moment, quiet, conclude_since)
        if told is None:
            continue
        if told.decision.verdict != 'unexplained':
            return told
        # Where records meet, a change may come from a wrong form of an effect, not from an onset.
        if moment.inside(first.data) and told.decision.left < least:
            best, least = told, told.decision.left
    return best


def _since(
    first: Conclusion,
    moment: Moment,
    quiet: Quiet | None,
    conclude: Callable[[Moment], Conclusion],
) -> Conclusion | None:
    """Return the conclusion from the data since a moment, where it has more weight.

    Args:
        first: the conclusion from all data.
        moment: when something may have appeared.
        quiet: data and fit before it, where Eq. (2) is enough there; if None, the effects found
            since then must be enough, less one of them or with other parameters.
        conclude: searches the data since a moment.
    """
    before, since = moment.split(first.data)
    held = first.prepared.since(moment).held
    if moments.counted(since) < moments.SHORTEST or moments.counted(held) < moments.HELD:
        return None
    second = conclude(moment)
    found, base = second.found, None
    if quiet is not None:
        before, base = quiet[0], replace(first.found.base, fit=quiet[1])
    complete = second.decision.verdict != 'unexplained'
    enough = moments.enough_before(before, base, found.final, found.material, complete)

    def told(most: float) -> Conclusion | None:
        bare = next((trial for trial, excess in enough if excess <= most), None)
        if bare is None:
            return None
        later = replace(
            second, appeared=Appeared(first.data, moment, bare, first.prepared.held.records)
        )
        later = replace(later, others=later.over_all_data(second.others))
        return later if later.outweighs(first) else None

    near = told(math.inf)
    if near is None or near.onset is None:
        return None
    onset = near.onset
    if onset.growth == 0.0 and onset.time > moment.time + SETTLE:
        # Data from before the onset bias the effects found: search those since then alone.
        later = Moment(moment.record, onset.time)
        again = moments.quiet_before(later, first.data)
        if (again or not quiet) and (other := _since(first, later, again, conclude)):
            return other
    return told(found.material)


def _asked(first: Conclusion) -> Iterator[tuple[Moment, Quiet | None]]:
    """Yield possible onsets, first those before which Eq. (2) is enough, with the data before.

    Then some of the others, inside of their records, if something material is left: each takes a
    search of its own.
    """
    others = []
    for moment in _moments(first):
        quiet = moments.quiet_before(moment, first.data)
        if quiet is not None:
            yield moment, quiet
        elif moment.inside(first.data):
            others.append(moment)
    if first.decision.left >= first.found.material:
        yield from ((moment, None) for moment in others[:_OTHERS])


def _moments(first: Conclusion) -> Iterator[Moment]:
    """Yield moments at which something may have appeared, likelier ones first."""
    whiten, told = first.scorer.whiten, list[Moment]()
    for fit in dict.fromkeys((first.found.base.fit, first.found.final.fit)):
        error, jacobian = fit.error, fit.jacobian
        # Where misfit remains, slow changes count little after whitening.
        for pair in ((whiten(error), whiten(jacobian)), (error, jacobian)):
            for moment, _ in moments.changes(first.data, *pair):
                if not any(moment.near(other) for other in told):
                    told.append(moment)
                    yield moment
