"""Effects that are there beyond chance but remove too little to matter.

They are not reported as missing. But their size is free in the posterior of the reported effects:
a gap that leaves 2 um doubles the damping found beside it. An effect that is not beyond chance, or
cannot be told from other groups, is left to the random discrepancy (discrepancy.py).
"""

from __future__ import annotations

from collections.abc import Sequence

from actuator_glue.diagnosis.learned.forms import CAUSES
from actuator_glue.diagnosis.refits.refits import Refits
from actuator_glue.diagnosis.search.beam_search import BeamSearch
from actuator_glue.diagnosis.thresholds import COMPANIONS, GROUP_ALONE, SEEN, TRIED
from actuator_glue.diagnosis.trial import Trial


def with_companions(
    beam: BeamSearch, final: Trial, least: float | None = None, *, alone: bool = True
) -> Trial:
    """Add effects that are significant at the user's level but too small to be told.

    Args:
        beam: what chose the structure.
        final: a structure that leaves nothing material.
        least: error that each must remove [m]; a fifth of what matters if not given.
        alone: whether each must be distinguishable from effects of other groups.
    """
    refits = beam.refits
    if final.own is not None:
        return final
    current = final
    least = SEEN * beam.material if least is None else least
    for _ in range(COMPANIONS):
        others = [n for n in refits.others(current) if not _of_one_kind(refits, n, final)]
        trials = beside(beam, current, others, least)
        if not trials or not beam.better(trials[0], current, least):
            break
        if alone and _weight_of_its_group(beam, trials) < GROUP_ALONE:
            break
        current = trials[0]
    return current


def _weight_of_its_group(beam: BeamSearch, trials: Sequence[Trial]) -> float:
    """Return the weight of the best effect's group among trials.

    Which of two lags it is may stay open; without either, beta_1 would be wrong.
    """
    groups = [beam.refits.entries[t.added].group for t in trials]
    shares = zip(beam.shares(trials), groups, strict=True)
    return float(sum(share for share, group in shares if group == groups[0]))


def alike(beam: BeamSearch, final: Trial, larger: Trial) -> list[tuple[Trial, float]]:
    """Return structures with an indistinguishable effect in place of a companion, with odds.

    Intervals average over indistinguishable effects (mixed_draws.mixed): beta_1 differs between
    the lag of a valve and one of the transducer.

    Args:
        beam: what chose the structure.
        final: the reported structure.
        larger: the same with its companions.
    """
    refits, out = beam.refits, list[tuple[Trial, float]]()
    for name in beyond(final, larger):
        rest, kind = [n for n in larger.effects if n != name], refits.entries[name].group
        like = [n for n in refits.others(larger) if refits.entries[n].group == kind]
        tried = [t for n in like if (t := refits.known((*rest, n))) is not None]
        shares = beam.shares([larger, *tried])
        out += [(t, float(w / shares[0])) for t, w in zip(tried, shares[1:], strict=True)]
    return out


def beside(beam: BeamSearch, current: Trial, names: Sequence[str], least: float) -> list[Trial]:
    """Refit a structure with the effects that promise most; best out-of-sample score first.

    Args:
        beam: what chose the structure.
        current: the structure.
        names: the effects.
        least: error that an effect must remove [m]; those that remove less are refitted roughly.
    """
    refits = beam.refits
    ranked = refits.promises.best(current, names)[:TRIED]
    below = current.mean_square - least**2
    return refits.additions(current, ranked, valves=False, below=below)


def _of_one_kind(refits: Refits, name: str, final: Trial) -> bool:
    """Whether an effect is another form of a reported one: two dry frictions are one."""
    causes = {CAUSES.get(told, told) for told in final.effects}
    holds = refits.entries[name].holds
    return name in causes or (holds is not None and holds[0] in causes)


def beyond(final: Trial, larger: Trial) -> list[str]:
    """Return the effects that a structure has beyond the reported one."""
    return [n for n in larger.effects if n not in final.effects]
