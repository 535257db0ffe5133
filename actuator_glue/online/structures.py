"""Proposals of structures to carry side by side, and how their weights move with forecasts.

    log w_S = log p_S - c sum_n (1 - a) a^(age of n) (e_S,n^2 - min_R e_R,n^2) / m^2

p_S is the weight that S came in with, e_S,n the rms error of a forecast that was fixed before its
data, m what matters: dynamic model averaging (Raftery, Karny & Ettler 2010) whose log score is
coarsened (Miller & Dunson 2019), so that an immaterial error decides nothing, however many samples
show it. Forecasts are forgotten, not p_S, which sums up all earlier data.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.inference.choice import ModelChoice, choose_model
from actuator_glue.inference.informative_prior import informative_prior
from actuator_glue.json_value import json_value
from actuator_glue.online.knowledge import Known
from actuator_glue.records import LONGEST_STROKE, Array

# c: nats that an error of m beyond the best costs if it lasts, as in a diagnosis of records.
COARSE = 4.0
# Window lengths after which a forecast counts 1/e.
MEMORY = 2.0
# A structure with less weight leaves.
LEAVES = 0.01
# Structures carried at most: all of them have to be sampled within one time budget.
MOST = 3
# Default of m, in standard deviations of the sensor noise.
MATERIAL = 0.5
# Limits of an m that is asked for [m]: no sensor of displacement resolves less, no actuator moves
# farther. Beyond them its square leaves the range of numbers.
MATERIALS = (1e-9, LONGEST_STROKE)
# Range of draws, over the largest, that says nothing: no record fixes a parameter so closely.
_ALIKE = 1e-9
# No single forecast costs more than this many (error/m)^2: it may have diverged.
_WORST = 1e3
# Least weight of a structure proposed beside another: less is not worth a share of the time.
BESIDE = 0.05
# Factor on the weights of structures carried before (each keeps `BESIDE` at least): a diagnosis of
# few data errs in one name of ten, and forecasts may bring an earlier one back.
BEFORE = 0.1
# Longest window, in hops, that leaves time for forecasts of all structures: those of one take 7 ms
# for a window of 10 s at 1 kHz.
_LEISURE = 20.0
# The leading structure leaves after this many windows, and this long [s], of forecasts worse than
# those of what was there before it.
WORSE, WORSE_SECONDS = 3, 1.0


@dataclass(frozen=True, slots=True)
class Proposed:
    """One structure that is to be carried.

    Attributes:
        model: Eq. (2) with its effects, and the prior's box.
        weight: its probability among those proposed with it.
        known: what earlier samples say of its parameters; None for the box alone.
    """

    model: ModelChoice
    weight: float = 1.0
    known: Known | None = None


@dataclass(frozen=True, slots=True)
class Proposal:
    """Structures to be carried from a window on, in place of all before.

    Attributes:
        structures: the likeliest first; `MOST` at most.
        material: smallest forecast error that matters [m]; NaN for half of the sensor noise.
        afresh: a structure that is carried already forgets what it learned from earlier samples.

    Raises:
        InputError: no or too many structures, one twice, a weight that is not positive, or
            knowledge that a structure's bounds contradict.
    """

    structures: tuple[Proposed, ...]
    material: float = field(default=math.nan, compare=False)
    afresh: bool = False

    def __post_init__(self) -> None:
        count = len(self.structures)
        if not 1 <= count <= MOST:
            raise InputError(f'{count} structures are proposed; 1 to {MOST} can be carried')
        if len({frozenset(one.model.effects) for one in self.structures}) < count:
            raise InputError('one structure is proposed twice')
        for one in self.structures:
            if not 0.0 < one.weight < math.inf:
                raise InputError(f'weight {one.weight:g} of a structure is not positive')
            if one.known is not None:
                model = one.model
                informative_prior(one.known.carried, model.names, model.lower, model.upper, None)

    @staticmethod
    def of(model: ModelChoice | Proposal) -> Proposal:
        """Return a model as a proposal of one structure; a proposal as it is."""
        return model if isinstance(model, Proposal) else Proposal((Proposed(model),))

    def described(self) -> str:
        """Return the structures and the weights they come in with, for people."""
        return ', '.join(
            f'Eq. (2) with {" + ".join(one.model.effects)} {share:.0%}'
            if one.model.effects
            else f'Eq. (2) alone {share:.0%}'
            for one, share in zip(self.structures, np.exp(self.log_weights), strict=True)
        )

    @property
    def plain(self) -> bool:
        """Whether it is one structure of which nothing is known, nor to be forgotten."""
        one = len(self.structures) == 1 and self.structures[0].known is None
        return one and not self.afresh

    def to_json(self) -> dict[str, Any]:
        """Return a JSON object from which `from_json` makes the same bits."""
        return {
            'material': json_value(self.material),
            'carried': [
                {
                    'effects': list(one.model.effects),
                    'parameters': list(one.model.names),
                    'lower': list(one.model.lower),
                    'upper': list(one.model.upper),
                    'start': [json_value(value) for value in one.model.start],
                    'weight': one.weight,
                    'known': None if one.known is None else one.known.to_json(),
                }
                for one in self.structures
            ],
            **({'afresh': True} if self.afresh else {}),
        }

    @staticmethod
    def from_json(value: Any, source: str = '') -> Proposal:
        """Return what `to_json` wrote.

        Raises:
            InputError: it is no such object, or names effects that the catalogue does not have.
        """
        try:
            found = []
            for one in value['carried']:
                names = [str(name) for name in one['parameters']]
                box = {
                    name: (float(lower), float(upper))
                    for name, lower, upper in zip(names, one['lower'], one['upper'], strict=True)
                }
                start = dict(zip(names, map(_number, one['start']), strict=False))
                known = one.get('known')
                found.append(
                    Proposed(
                        choose_model([str(name) for name in one['effects']], box, start),
                        float(one['weight']),
                        None if known is None else Known.from_json(known, source),
                    )
                )
            return Proposal(
                tuple(found), _number(value['material']), bool(value.get('afresh', False))
            )
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            raise InputError(f'{source}: the structures cannot be read ({error})') from error

    @property
    def log_weights(self) -> Array:
        """Log probabilities (K,) that they come in with."""
        weights = np.array([one.weight for one in self.structures])
        return np.asarray(np.log(weights / weights.sum()))


def spreads(column: Array) -> bool:
    """Return whether the draws (m,) of a parameter differ by more than rounding can."""
    return bool(np.ptp(column) > _ALIKE * np.abs(column).max())


def most_in_all(window: float, hop: float) -> int:
    """Return the largest number of structures carried, those from before included.

    Args:
        window: length of a window [s].
        hop: time from one window to the next [s].
    """
    return 2 * MOST if hop * _LEISURE >= window else MOST + 1


def _number(value: Any) -> float:
    return math.nan if value is None else float(value)


def moved(
    evidence: Array, errors: Sequence[float], material: float, seconds: float, memory: float
) -> Array:
    """Return the evidence (K,) of structures after forecasts [nats].

    Args:
        evidence: before them.
        errors: mean square error of each structure's forecasts [m^2]; one that made none (NaN)
            keeps its evidence.
        material: smallest error that matters [m].
        seconds: time since the forecasts before.
        memory: time after which a forecast counts 1/e [s].
    """
    squares = np.array(errors, np.float64)
    told = np.isfinite(squares)
    if told.sum() < 2 or not material > 0.0:
        return evidence
    excess = np.minimum((squares[told] - squares[told].min()) / material**2, _WORST)
    kept = math.exp(-seconds / memory)
    out = evidence.copy()
    out[told] = kept * out[told] - (1.0 - kept) * COARSE * excess
    return out


def weights(log_prior: Array, evidence: Array) -> Array:
    """Return the weights (K,) of structures from log priors and the evidence of forecasts."""
    logs = log_prior + evidence
    found = np.exp(logs - logs.max(initial=-np.inf))
    return np.asarray(found / found.sum())


def pooled(
    names: tuple[str, ...],
    parts: Sequence[tuple[float, tuple[str, ...], Array]],
    rng: np.random.Generator,
) -> Array:
    """Return draws (m, p) of a mixture of posteriors, as many as the first one has.

    In the rows of a structure, a parameter that it lacks keeps its draw from the first part.

    Args:
        names: the p parameters wanted, those of the first part.
        parts: weight, parameters and draws (m', p') of each posterior.
        rng: random numbers.
    """
    first = parts[0][2]
    if len(parts) == 1:
        return first
    shares = np.array([weight for weight, _, _ in parts])
    which = rng.choice(len(parts), len(first), p=shares / shares.sum())
    out = first.copy()
    for i, (_, theirs, draws) in enumerate(parts[1:], 1):
        mine = np.flatnonzero(which == i)
        rows = draws[rng.integers(0, len(draws), len(mine))]
        for j, name in enumerate(names):
            if name in theirs:
                out[mine, j] = rows[:, theirs.index(name)]
    return out
