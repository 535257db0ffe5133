"""What a diagnosis takes from an estimator, and what that is to carry because of it."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from actuator_glue.api.diagnosis import Diagnosis
from actuator_glue.diagnosis.finding import Finding
from actuator_glue.diagnosis.verdict.rules import against
from actuator_glue.inference.carried import FEWEST, Carried, Drift
from actuator_glue.inference.choice import ModelChoice, choose_model
from actuator_glue.inference.prior_use import GivenPrior
from actuator_glue.inference.transforms.inverse_response import Ridge
from actuator_glue.model.effects import CATALOGUE
from actuator_glue.online.knowledge import Known
from actuator_glue.online.structures import BESIDE, LEAVES, MOST, Proposal, Proposed
from actuator_glue.online.when_to_diagnose import Concluded
from actuator_glue.records import Array, Record

# Largest share of a diagnosis' usual effort: one that takes a core more than half a minute comes
# too late for its samples, and the next diagnosis has more of them.
EFFORT = 0.6
# Eq. (2) alone is carried beside every addition, at least with this weight, until its forecasts
# exclude it: what a diagnosis is sure of, it is sure of for the data that it has seen.
_PLAIN = 0.02
# Parameter that tests under a single stiffness leave open.
_OIL = 'alpha_2'
# Weight of a structure with effects that have no probability: learned terms.
_DESCRIBED = 0.9
_OPEN = ('unexplained', 'undecided')
_LEVEL = 'the level has moved, which every window takes out by itself (Eq. (4))'


def given(known: tuple[Carried, Drift, float] | None) -> GivenPrior | None:
    """Return what an estimator knew before some records as the prior of their diagnosis.

    Args:
        known: draws at the records' beginning, how they drift, and their age [s]; None where
            nothing was known.
    """
    if known is None:
        return None
    carried, drift, age = known
    return GivenPrior(carried, 'the estimator', drift.every, age)


def carriable(effects: Sequence[str]) -> tuple[str, ...]:
    """Return the effects that an estimator can carry.

    A window's likelihood takes the mean out of the error (Eq. (4)): it says nothing of effects
    that only move the level.

    Args:
        effects: names.
    """
    return tuple(n for n in effects if n not in CATALOGUE or CATALOGUE[n].group != 'offset')


def concluded(found: Diagnosis, records: Sequence[Record], apply: bool | None = None) -> Concluded:
    """Return what a diagnosis of a stream means for the live loop.

    Args:
        found: the diagnosis.
        records: what was diagnosed.
        apply: whether the estimator is to carry it; None for what the loop's settings say.
    """
    open_ = found.verdict in _OPEN or bool(found.doubts)
    left_open = open_ or any(
        effect.alternatives for effect in found.effects if carriable((effect.name,))
    )
    why_not = against(found.verdict, found.effects, found.structure, found.error)
    if found.verdict == 'none' and not found.doubts:
        return Concluded(Proposal.of(choose_model()), '', left_open, apply, frozenset())
    supported = frozenset(found.structure)
    if found.structure and not carriable(found.structure):
        # The level is settled, whichever of its names is the cause.
        return Concluded(None, _LEVEL, open_, apply, supported)
    learned = ', '.join(term.name for term in found.learned)
    if learned and not why_not:
        why_not = f'{learned} was learned from these records: no effect of the catalogue'
    if why_not:
        return Concluded(None, why_not, left_open, apply, supported)
    return Concluded(proposed(found, records), '', left_open, apply, supported)


def proposed(found: Diagnosis, records: Sequence[Record]) -> Proposal:
    """Return the structures that a diagnosis leaves possible, with what it knows of their sizes.

    The diagnosed structure comes with its posterior, which is dated to the middle of its data and
    leaves open what they leave open; structures tied with it come without a posterior, and so does
    Eq. (2) alone.
    """
    start, end = _since(found, records), records[-1].stamp_ns(len(records[-1]) - 1)
    model, draws = _within_bounds(found)
    draws = _opened(found, records, model, draws)
    middle, known = (start + end) // 2, None
    if len(draws) >= FEWEST:
        carried = Carried.thinned(model.names, draws).later((middle - start) * 1e-9)
        known = Known(carried, middle, end)
    main = Proposed(model, _weight(found), known)
    others = [Proposed(choose_model(names), odds * main.weight) for names, odds in _tied(found)]
    others = sorted(others, key=lambda one: -one.weight)[: MOST - 2]
    others = [one for one in others if one.weight >= BESIDE]
    left = 1.0 - main.weight - sum(one.weight for one in others)
    plain = Proposed(choose_model(), max(left, _PLAIN))
    return Proposal((main, *others, plain), found.alarm.threshold)


def _since(found: Diagnosis, records: Sequence[Record]) -> int:
    """Return the start of the data from which the sizes were found [ns]."""
    if found.onset is not None:
        for record in records:
            if record.source == found.onset.source:
                return record.start_ns + round(found.onset.time * 1e9)
    return records[0].start_ns


def _within_bounds(found: Diagnosis) -> tuple[ModelChoice, Array]:
    """Return the augmented model, where to start with it, and its draws (m, p) inside its box.

    Draws of what a record leaves open may reach far beyond the box, where they are impossible.
    """
    model = choose_model(carriable(found.structure))
    draws = found.joint[:, [found.names.index(name) for name in model.names]]
    lower, upper = model.bounds
    inside = draws[((draws > lower) & (draws < upper)).all(axis=1)]
    if not len(inside):
        return model, inside
    start = dict(zip(model.names, np.median(inside, axis=0).tolist(), strict=True))
    return choose_model(model.effects, start=start), inside


def _opened(
    found: Diagnosis, records: Sequence[Record], model: ModelChoice, draws: Array
) -> Array:
    """Return draws (m, p) as wide as one stiffness leaves them inside the box.

    A diagnosis draws only around its fit along that ridge, which says nothing of the machine's
    place on it: as a prior it would be believed.
    """
    stiffness = {record.known_stiffness() for record in records}
    given = found.prior is not None and _OIL in found.prior.names
    told = given or found.base[_OIL].identified
    if told or len(stiffness) > 1 or not len(draws):
        return draws
    return Ridge(model.names, *model.bounds, stiffness.pop()).opened(
        draws, np.random.default_rng(0)
    )


def _weight(found: Diagnosis) -> float:
    """Return the probability of the diagnosed structure."""
    told = carriable(found.structure)
    each = [_probability(effect) for effect in found.effects if effect.name in told]
    return float(np.clip(np.prod(each), LEAVES, 1.0 - _PLAIN))


def _probability(effect: Finding) -> float:
    return _DESCRIBED if math.isnan(effect.probability) else effect.probability


def _tied(found: Diagnosis) -> list[tuple[tuple[str, ...], float]]:
    """Return structures with a tied name in place of a reported one, and their odds against it."""
    told = carriable(found.structure)
    out: dict[frozenset[str], tuple[tuple[str, ...], float]] = {}
    for effect in found.effects:
        if effect.name not in told:
            continue
        rest = [name for name in told if name != effect.name]
        for rival in effect.rivals:
            names = tuple(dict.fromkeys((*rest, *carriable(rival.effects))))
            if rival.tied and names and frozenset(names) != frozenset(told):
                odds = min(rival.probability / max(_probability(effect), LEAVES), 1.0)
                out.setdefault(frozenset(names), (names, odds))
    return list(out.values())
