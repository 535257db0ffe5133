"""The recorded force as evidence between names that the displacement leaves tied.

The displacement shows a force only through the oil; the load cell shows it directly. Tied
structures are refitted to both channels and ranked by their score on both; gain and offset of each
load cell are fitted in each record, and its noise is its own. Whether anything is missing, its
size and its error are still decided by the displacement; an effect that only the force shows, and
the displacement takes for leakage, oil or noise, is reported.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from actuator_glue.diagnosis.finding import Rival
from actuator_glue.diagnosis.refits.refits import Refits
from actuator_glue.diagnosis.samples.force import newtons_per_metre, with_forces
from actuator_glue.diagnosis.score.scorer import Scorer, evidence, pooled, splits_of
from actuator_glue.diagnosis.score.weights import log_weight
from actuator_glue.diagnosis.search.ties import compare
from actuator_glue.diagnosis.selection import Selection
from actuator_glue.diagnosis.thresholds import NOISE_SHARE, TELLING
from actuator_glue.diagnosis.trial import Trial
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.inference.least_squares.fit import Fit, fit, rms
from actuator_glue.model.effects import Effect

_COARSE = 8  # iterations of rough refits
_WEIGHINGS = 3  # of the channels, by the errors of the best structure so far


@dataclass(frozen=True)
class Ranked:
    """Structures refitted to both channels.

    Attributes:
        trials: best first.
        rivals: names in the order of the trials, as `ties.compare` gives them.
        errors: rms error of each name's force [N].
    """

    trials: tuple[Trial, ...]
    rivals: tuple[Rival, ...]
    errors: dict[str, float]


def decided(refits: Refits, found: Selection) -> tuple[Selection, tuple[str, ...]]:
    """Let the forces choose among tied names; return the choice, and notes for people."""
    notes = []
    for name in found.final.effects:
        rest = [n for n in found.final.effects if n != name]
        row = [r for r in found.rivals[name] if len(r.effects) == 1]
        tied = [r.name for r in row if r.tied and r.name != name]
        known = [trial for n in tied if (trial := refits.known((*rest, n))) is not None]
        if not known or found.final.own is not None:
            continue
        rivals = [replace(t, added=n) for t, n in zip(known, tied, strict=False)]
        alone = refits.without(found.final, name)
        ranked = _ranked(refits, alone, [replace(found.final, added=name), *rivals])
        found = _swapped(refits, found, name, ranked)
        notes.append(_told(ranked))
    return found, (*notes, *_unseen(refits, found))


def _ranked(refits: Refits, rest: Trial, contenders: Sequence[Trial]) -> Ranked:
    tried, best = [rest, *contenders], contenders[0]
    for _ in range(_WEIGHINGS):
        both = with_forces(refits.data, best.structure, best.fit.theta)

        def refitted(trial: Trial, data: Data = both) -> Trial:
            return replace(trial, fit=fit(data, trial.structure, trial.fit.theta))

        tried = list(refits.each(refitted, tried))
        best = min(tried[1:], key=lambda t: t.fit.rms)
    scorer, material = _scorer(both, best.fit)

    def weight(trial: Trial) -> float:
        left_out = scorer.left_out_error(trial.fit)
        return log_weight(left_out, TELLING * material, len(trial.fit.theta))

    alone, *trials = (scorer.scored(t) for t in tried)
    trials.sort(key=weight, reverse=True)
    first = weight(trials[0])
    odds = [math.exp(min(weight(t) - first, 0.0)) for t in (*trials[1:], alone)]
    rivals = compare(alone, trials[0], trials[1:], odds, scorer)
    size = newtons_per_metre(both)
    force = slice(refits.data.target.size, None)
    errors = {t.added: size * rms(t.fit.error[force]) for t in trials}
    return Ranked(tuple(trials), rivals, errors)


def _scorer(both: Data, found: Fit) -> tuple[Scorer, float]:
    """Take both channels' noise, and the error that matters, from what a structure leaves."""
    splits = splits_of(both, found.error)
    left, noise = pooled(both, splits)
    material = NOISE_SHARE * noise
    return replace(Scorer.of(both, splits), likely=left < material), material


def _swapped(refits: Refits, found: Selection, name: str, ranked: Ranked) -> Selection:
    """Return the selection with the best name in place of a tied one, and new weights."""
    best = ranked.trials[0]
    final = refits.polish(refits.trial(best.effects, best.added))
    mine = {r.name for r in ranked.rivals}
    others = [replace(r, tied=False) for r in found.rivals[name] if r.name not in mine]
    # The force redistributes the probability that the tied names had together.
    share = 1.0 - sum(r.probability for r in others)
    told = [replace(r, probability=share * r.probability) for r in ranked.rivals]
    rivals = {n: row for n, row in found.rivals.items() if n != name}
    rivals[best.added] = (*told, *others)
    gains, nats = refits.worth(final)
    return replace(found, final=final, rivals=rivals, removed=gains, evidence=nats)


def _told(ranked: Ranked) -> str:
    errors = ', '.join(f'{n} {e:.3g} N' for n, e in ranked.errors.items())
    tied = [r.name for r in ranked.rivals if r.tied]
    best = ranked.trials[0].added
    said = (
        f'the force cannot tell {", ".join(tied)} apart'
        if len(tied) > 1
        else f'the force says {best}'
    )
    return f'{said}; its error, of refits to both channels: {errors}'


def _unseen(refits: Refits, found: Selection) -> tuple[str, ...]:
    """Name a further effect that only the force shows, if there is one."""
    final, count = found.final, refits.data.target.size
    names = [n for n in refits.names if n not in final.effects and _is_felt(refits.entries[n])]
    if final.own is not None or not names:
        return ()
    without = final.fit
    for _ in range(_WEIGHINGS):
        both = with_forces(refits.data, final.structure, without.theta)
        without = fit(both, final.structure, without.theta)

    def added(name: str) -> Trial:
        structure = refits.structure(*final.effects, name)
        starts = refits.promises.screen(final, name)[1].copy()
        starts[:, [p in final.structure.parameters for p in structure.parameters]] = without.theta
        rough = fit(both, structure, starts, iterations=_COARSE)
        return Trial(structure, name, rough, final.scores)

    best = min(refits.each(added, names), key=lambda t: t.fit.rms)
    with_it = fit(both, best.structure, best.fit.theta)
    scorer, _ = _scorer(both, with_it)
    nats = evidence(scorer.block_scores(with_it), scorer.block_scores(without))
    size = newtons_per_metre(both)
    before, after = (size * rms(f.error[count:]) for f in (without, with_it))
    least = NOISE_SHARE * after
    if (
        nats - len(with_it.theta) + len(without.theta) < found.nats
        or before**2 - after**2 < least**2
    ):
        return ()
    name = best.added
    return (
        f'the force shows {name}, which the displacement does not: its error '
        f'falls from {before:.3g} to {after:.3g} N ({nats:.0f} nats); calibrate with '
        f'--effect {name} --use-force',
    )


def _is_felt(effect: Effect) -> bool:
    """Whether a load cell feels an effect; richer forms of friction do not count."""
    return effect.place == 'specimen' or (effect.group == 'friction' and effect.holds is None)
