"""How sure a ranking is: rival structures, their distance with its standard error, their weights.

Scores come block by block, so that the spread over blocks says how far a ranking is chance, and
so do the weights. A rival is tied by its weight alone: what is told as an alternative has a
probability, and what has none is no alternative.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from actuator_glue.diagnosis.finding import BESIDE, Rival
from actuator_glue.diagnosis.learned.forms import CAUSES
from actuator_glue.diagnosis.learned.friction import SHAPES
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
# Share of the bounds within which a parameter is at one of them.
_AT_BOUND = 1e-3
_NOT_NEAR = 0.1  # of the best's weight: excess beyond the tolerance
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


def stays(search: Search, settings: Thresholds, name: str, rival: Rival, material: float) -> bool:
    """Return whether a description stays where a name comes near to it.

    Beyond chance, and by what it must; dry friction's shapes by less, as they move what else is
    found.
    """
    much = 0.0 if name in SHAPES else least_removed(name, rival.effects, material)
    return rival.nats >= decisive(search, settings) and rival.excess >= much


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


def pressed_form(search: Search, trial: Trial, name: str, simpler: str) -> bool:
    """Whether an effect is a richer form of another only by a parameter at its bound.

    Such a form mends the other's equation. Near its neutral value a size is small, not held.
    """
    entry = search.entries.get(name)
    if entry is None or entry.holds is None or entry.holds[0] != simpler:
        return False
    columns = trial.structure.columns(name)
    return any(
        abs(value - end) < _AT_BOUND * (p.upper - p.lower)
        for p, value in zip(entry.parameters, trial.fit.theta[columns], strict=True)
        for end in (p.lower, p.upper)
        if end != p.neutral
    )


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


def _without_best_blocks(scores: Array, richer: Sequence[bool]) -> Array:
    """Return scores (K, B) in which the first is not ahead of another by its best block alone.

    Nor is it behind one that is richer. As in `evidence`: what one stretch of a record alone
    supports is not evidence.
    """
    out, lead = scores.copy(), scores[0] - scores
    rows, best = np.arange(len(scores)), lead.argmax(axis=1)
    out[rows, best] += np.maximum(lead[rows, best], 0.0)
    for row in np.flatnonzero(richer):
        worst = lead[row].argmin()
        out[row, worst] += min(float(lead[row, worst]), 0.0)
    return out


def compare(
    rest: Trial,
    best: Trial,
    trials: Sequence[Trial],
    scorer: Scorer,
    settings: Thresholds,
    cost: float = 0.0,
    whole: Sequence[bool] = (),
    pressed: Sequence[bool] = (),
) -> tuple[Rival, ...]:
    """Say how far behind the best each rival is, best first.

    Args:
        rest: the structure without the effect; its weight is that of "none of these".
        best: the structure with it, added last.
        trials: structures with another effect in its place.
        scorer: noise that they were scored with.
        settings: thresholds.
        cost: nats that a pair of effects pays for being one of many.
        whole: which of `trials` leave nothing material where the best does: they mend no form.
        pressed: which are the effect itself but for a parameter at its bound: what they have more
            of weight is its, for they mend its equation.
    """
    name, explained = best.added, removed(rest, best)
    odds = np.array([math.exp(-cost) if BESIDE in t.added else 1.0 for t in trials])
    every = (best, *trials, rest)
    richer = [len(t.fit.theta) > len(best.fit.theta) for t in every]
    scores = _without_best_blocks(np.stack([t.scores for t in every]), richer)
    scores[1:-1] += np.log(odds)[:, None] / scores.shape[1]
    known = weights(scores)
    excess = [removed(t, best) for t in trials]
    limits = [_limit(t, name, scorer) for t in trials]
    # A richer form that gains nothing is no alternative, unless it holds the effect itself.
    idle = [
        more and best.scores.sum() >= t.scores.sum() and limit is None
        for t, limit, more in zip(trials, limits, richer[1:-1], strict=True)
    ]
    alike = [math.inf if i else e for i, e in zip(idle, excess, strict=True)]
    tolerance = settings.tie_share * explained
    ends = whole or [False] * len(trials)
    for trial, weight, end in zip(trials, known[1:-1], ends, strict=True):
        if not end and weight > known[0]:  # not the one that speaks, but better by the blocks
            known[0] = max(known[0], weight * _near(removed(best, trial), tolerance))
    for i in np.flatnonzero(pressed):
        both = known[0] + known[1 + i]
        known[0] = max(known[0], 0.5 * both)
        known[1 + i] = both - known[0]
    # Nor is one that holds it and gains nothing more than another name for it.
    held = [
        limit is not None and best.scores.sum() >= t.scores.sum()
        for t, limit in zip(trials, limits, strict=True)
    ]
    told = known.copy()
    told[1:-1][held] = np.minimum(told[1:-1], settings.mistaken * known[0])[held]
    told = _tolerant(told, alike, tolerance, settings.mistaken * odds)
    known = _tolerant(known, alike, tolerance, odds)
    out = [Rival(name, 0.0, 0.0, 0.0, True, float(known[0]), float(told[0]))]
    for i, trial in enumerate(trials):
        near = known[1 + i] > math.exp(-settings.tie_nats) * known[0]
        tied = bool(near and removed(rest, trial) > _SAME * explained and not idle[i])
        nats = max(0.0, evidence(best.scores, trial.scores))
        stderr = standard_error(best.scores - trial.scores)
        limit = limits[i] if near else None
        weight, probability = float(known[1 + i]), float(told[1 + i])
        out.append(Rival(trial.added, nats, stderr, excess[i], tied, weight, probability, limit))
    return tuple(sorted(out, key=lambda r: (r.nats, r.name != name)))


def _near(excess: float | Array, tolerance: float) -> Array:
    """Share of another's weight that a structure has which leaves this much more error [m]."""
    near = np.exp(-2.0 * (np.asarray(excess) / max(tolerance, 1e-15)) ** 2)
    return np.where(near > _NOT_NEAR, near, 0.0)


def _tolerant(
    known: Array, excess: Sequence[float], tolerance: float, odds: float | Array = 1.0
) -> Array:
    """Let rivals that leave as good as the same error share the best's weight (K + 2,).

    The catalogue's equations are not the machine's: differences well below the share at which
    two effects count as tied are its form's, whatever the nats. `odds` says what share.
    """
    out = known.copy()
    shared = known[0] * odds * _near(np.array(excess), tolerance)
    out[1:-1] = np.maximum(out[1:-1], shared)
    return np.asarray(out / out.sum())


def spokesman(name: str, rivals: Sequence[Rival], groups: Mapping[str, str]) -> str:
    """Return which of the tied names is told: the best of the group with most of the weight.

    One name may be barely ahead of three of another group, lags say, that fit alike. Then the best
    of that group is told.

    Args:
        name: the best.
        rivals: its rivals, itself among them, best first.
        groups: kind of each effect.
    """
    tied = [r for r in rivals if r.tied and r.name in groups]
    kinds = {groups[r.name]: [t for t in tied if groups[t.name] == groups[r.name]] for r in tied}
    own = kinds.get(groups.get(name, ''), [])
    for members in kinds.values():
        heavier = sum(r.weight for r in members) > sum(r.weight for r in own)
        if len(members) > len(own) > 0 and heavier:
            return members[0].name
    return name


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
