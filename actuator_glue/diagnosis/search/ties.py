"""Ties: names that these records cannot tell from the reported one, and their structures.

Every alternative has a probability, and a name without one is no alternative (weights.py). A lag
of the transducer and one of the valve fit the same motion with different values of beta_1. Where a
name has alternatives, an interval under that name alone is too narrow: intervals of Eq. (2)'s
parameters, and of the sizes of other effects, are those of the mixture of all structures, each
with the weight of its name.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from actuator_glue.diagnosis.finding import Rival
from actuator_glue.diagnosis.refits.refits import Refits
from actuator_glue.diagnosis.score.scorer import Scorer, evidence, inflation, standard_error
from actuator_glue.diagnosis.selection import Selection
from actuator_glue.diagnosis.thresholds import TIE_NATS, TIED
from actuator_glue.diagnosis.trial import Trial, removed
from actuator_glue.model.effects import CATALOGUE

_NORMAL_95 = 1.959964
_LEAST = 1e-3  # least probability of the reported name that odds are relative to


def compare(
    rest: Trial,
    best: Trial,
    trials: Sequence[Trial],
    odds: Sequence[float],
    scorer: Scorer,
) -> tuple[Rival, ...]:
    """Return the rivals with their probabilities beside the best, best first.

    Args:
        rest: the structure without the effect; its weight is that of "none of these".
        best: the structure with it, added last.
        trials: structures with another effect in its place.
        odds: weights of `trials` and `rest` relative to that of the best.
        scorer: noise that they were scored with.
    """
    explained, total = removed(rest, best), 1.0 + sum(odds)
    out = [Rival(best.added, 0.0, 0.0, 0.0, True, 1.0 / total)]
    for trial, share in zip(trials, odds[:-1], strict=True):
        near = share > math.exp(-TIE_NATS)
        tied = near and removed(rest, trial) > TIED * explained
        nats = max(0.0, evidence(best.scores, trial.scores))
        stderr = standard_error(best.scores - trial.scores)
        limit = _limit(trial, best.added, scorer) if near else None
        excess = removed(trial, best)
        out.append(Rival(trial.added, nats, stderr, excess, tied, share / total, limit))
    return (out[0], *sorted(out[1:], key=lambda r: -r.probability))


def tied_structures(refits: Refits, found: Selection) -> list[tuple[Trial, float]]:
    """Return structures with a tied effect in place of the told one, and their odds.

    Args:
        refits: what was refitted.
        found: the reported structure, with its rivals.
    """
    final = found.final
    out: list[tuple[Trial, float]] = []
    for name in final.effects if final.own is None else ():
        row = {rival.name: rival for rival in found.rivals[name]}
        rest = [n for n in final.effects if n != name]
        for rival in row.values():
            trial = refits.known((*rest, *rival.effects)) if rival.tied else None
            if trial is not None and rival.name != name:
                out.append((trial, rival.probability / max(row[name].probability, _LEAST)))
    return out


def _limit(trial: Trial, name: str, scorer: Scorer) -> tuple[str, float] | None:
    """95 % limit of the parameter that makes the effect added last a richer form of another."""
    effect = CATALOGUE.get(trial.added)
    if effect is None or effect.holds is None or effect.holds[0] != name:
        return None
    _, parameter, value = effect.holds
    at = next(i for i, p in enumerate(trial.model.parameters) if p.name == parameter)
    bounds = trial.model.parameters[at]
    jac, error = scorer.whiten(trial.fit.jacobian), scorer.whiten(trial.fit.error)
    move = np.zeros(len(jac))
    if scorer.likely:
        move = scorer.moves(trial.fit, error, jac, (slice(0),))[0]
        error = error - move @ jac
    scale = np.sqrt(np.maximum(np.einsum('pn,pn->p', jac, jac), 1e-300))
    jac /= scale[:, None]
    inverse = np.linalg.pinv(jac @ jac.T, rcond=1e-10, hermitian=True)
    spread = _NORMAL_95 * float(np.sqrt(inflation(error) * inverse[at, at])) / float(scale[at])
    fitted = float(trial.fit.theta[at] + move[at])
    limit = fitted + spread if fitted >= value else fitted - spread
    return parameter, float(np.clip(limit, bounds.lower, bounds.upper))
