"""How sure a ranking is: rivals with their shares of the weight, and weights from block scores.

What is told as an alternative has a probability, and what has none is no alternative (weights.py).
Where the question is chance alone, scores come block by block, so that the spread over blocks says
how far a ranking is chance.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from actuator_glue.diagnosis.finding import Rival
from actuator_glue.diagnosis.learned.forms import CAUSES
from actuator_glue.diagnosis.learned.term import is_learned
from actuator_glue.diagnosis.likelihood import inflation
from actuator_glue.diagnosis.score import Scorer, evidence
from actuator_glue.diagnosis.search import Search
from actuator_glue.diagnosis.thresholds import Thresholds
from actuator_glue.diagnosis.trial import Trial
from actuator_glue.model.effects import CATALOGUE
from actuator_glue.records import Array

_DRAWS = 2000
_SEED = 0
_NORMAL_95 = 1.959964
MUCH = 0.5  # of what matters: a description in the place of a name removes so much
_SAME = 0.5  # of what the best removes: a rival that removes less is none
# A tie asks for nearly all of it: a rough refit that removes less is not worth the last digits.
_NEARLY = 0.9


def removed(before: Trial, after: Trial) -> float:
    """Rms error that a larger structure removes [m]."""
    return float(np.sqrt(max(0.0, before.mean_square - after.mean_square)))


def decisive(search: Search, settings: Thresholds) -> float:
    """Return by how many nats a description, one of many, must be better than a name."""
    forms = sum(map(is_learned, search.entries.values()))
    return settings.nats + math.log(max(forms, 1))


def least_removed(form: str, names: Sequence[str], material: float) -> float:
    """Return what a description must remove in the place of names, which are more than it [m].

    Half of what matters, or all of that where it is another shape of one of them.
    """
    return material if CAUSES.get(form) in names else MUCH * material


def left_by_rivals(rest: Trial, best: Trial) -> float:
    """Mean squared error that a rough refit of a rival leaves that is worth finishing [m^2]."""
    return rest.mean_square - _NEARLY**2 * (rest.mean_square - best.mean_square)


def worth(search: Search, final: Trial) -> tuple[dict[str, float], dict[str, float]]:
    """Return rms error [m] and nats that each effect takes away beside the others."""
    gains, nats = {}, {}
    for name in final.effects:
        rest = search.without(final, name)
        gains[name], nats[name] = removed(rest, final), evidence(final.scores, rest.scores)
    return gains, nats


def standard_error(difference: Array) -> float:
    """Return the standard error of the sum of block differences (B,) [nats]."""
    # Of a structure that diverges without a block, squares may overflow.
    size = float(np.abs(difference).max()) or 1.0
    return float(np.sqrt(len(difference)) * (difference / size).std(ddof=1)) * size


def weights(scores: Array) -> Array:
    """Return the probability of every structure (K,) from its out-of-sample block scores (K, B).

    The blocks are reweighted as in the Bayesian bootstrap, and the structures by the exponential
    of their score in every such draw (pseudo-BMA+: Yao, Vehtari, Simpson & Gelman 2018).
    """
    count = scores.shape[1]
    share = np.random.default_rng(_SEED).dirichlet(np.ones(count), _DRAWS)
    total = count * (scores - scores.max(axis=0)) @ share.T
    likely = np.exp(np.maximum(total - total.max(axis=0), -700.0))
    return np.asarray((likely / likely.sum(axis=0)).mean(axis=1))


def compare(
    rest: Trial,
    best: Trial,
    trials: Sequence[Trial],
    odds: Sequence[float],
    scorer: Scorer,
    settings: Thresholds,
) -> tuple[Rival, ...]:
    """Say how likely each rival is beside the best, best first.

    Args:
        rest: the structure without the effect; its weight is that of "none of these".
        best: the structure with it, added last.
        trials: structures with another effect in its place.
        odds: weights of `trials` and `rest` beside that of the best.
        scorer: noise that they were scored with.
        settings: thresholds.
    """
    explained, total = removed(rest, best), 1.0 + sum(odds)
    out = [Rival(best.added, 0.0, 0.0, 0.0, True, 1.0 / total)]
    for trial, share in zip(trials, odds[:-1], strict=True):
        near = share > math.exp(-settings.tie_nats)
        tied = near and removed(rest, trial) > _SAME * explained
        nats = max(0.0, evidence(best.scores, trial.scores))
        stderr = standard_error(best.scores - trial.scores)
        limit = _limit(trial, best.added, scorer) if near else None
        excess = removed(trial, best)
        out.append(Rival(trial.added, nats, stderr, excess, tied, share / total, limit))
    return (out[0], *sorted(out[1:], key=lambda r: -r.probability))


def _limit(trial: Trial, name: str, scorer: Scorer) -> tuple[str, float] | None:
    """How far the effect added last may be from another of which it is a richer form."""
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
