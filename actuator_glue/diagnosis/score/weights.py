"""One weight for every structure: its error in units of what matters, and its price.

Between structures with the same number of additions (effects, another hold, an onset):

    log w = -e^2 / s^2 - p - log(structures of as many that could have been tried)

e is the rms error of blocks left out, p the number of parameters, s a twentieth of what matters: a
coarsened posterior (Miller & Dunson 2019, J. Am. Stat. Assoc. 114:1113). With minutes of samples
nats of independent noise tell any two equations apart, and neither of them is the machine's:
differences count in units of what matters. Nats answer one question only: is it there beyond
chance.

Whether there is another addition is decided between the best structures of each number with
s = m / 2, m what matters: an effect that removes just m gains four nats. Otherwise effects that
matter less would be reported as surely as they are there. The error of a learned term counts with
half of what matters in addition: a name says what to mend.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from actuator_glue.diagnosis.learned.forms import descriptions
from actuator_glue.diagnosis.learned.term import is_learned
from actuator_glue.diagnosis.thresholds import MATTERING, REPLACING
from actuator_glue.model.effects import Effect
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array


def counted(left_out: float, effects: Iterable[str], material: float) -> float:
    """Return the error of a structure that counts in its weight [m].

    Args:
        left_out: rms error of blocks left out [m].
        effects: of the structure; a learned term that is another shape of a named cause counts as
            that name.
        material: least rms error that matters [m].
    """
    return math.hypot(left_out, math.sqrt(descriptions(effects)) * REPLACING * material)


def log_weight(left_out: float, tells: float, cost: float) -> float:
    """Return the logarithm of a structure's weight, up to what all have in common [nats].

    Args:
        left_out: rms error of blocks left out [m].
        tells: rms error that costs a nat, `TELLING` of what matters [m].
        cost: its price [nats].
    """
    return -((left_out / tells) ** 2) - cost


def log_weights(
    left_out: Sequence[float],
    costs: Sequence[float],
    additions: Sequence[int],
    material: float,
    telling: float,
) -> Array:
    """Return the logarithms of the weights of all structures of a table (K,), the greatest 0.

    Args:
        left_out: rms error of blocks left out, of each [m].
        costs: price of each [nats].
        additions: how much each adds to Eq. (2) as given.
        material: least rms error that matters [m].
        telling: of that, the error that costs a nat between structures with as many additions.
    """
    pairs = list(zip(left_out, costs, strict=True))
    named = np.array([log_weight(e, telling * material, cost) for e, cost in pairs])
    there = np.array([log_weight(e, MATTERING * material, cost) for e, cost in pairs])
    out = np.full(len(pairs), -np.inf)
    for count in set(additions):
        own = (np.array(additions) == count) & np.isfinite(named)
        if own.any():
            best = np.argmax(np.where(own, named, -np.inf))
            out[own] = there[best] + named[own] - np.logaddexp.reduce(named[own])
    return np.asarray(out - out.max())


def price(structure: Structure, entries: Mapping[str, Effect], named: int) -> float:
    """Return what a structure costs besides its error [nats].

    Args:
        structure: Eq. (2) with effects.
        entries: all effects there are, learned terms among them.
        named: how many effects of the catalogue could have been added.
    """
    terms = sum(map(is_learned, structure.entries))
    forms = max(sum(map(is_learned, entries.values())), terms)
    names = len(structure.entries) - terms
    chosen = choices(max(named, names), names) + choices(forms, terms)
    return len(structure.parameters) + chosen


def choices(count: int, taken: int) -> float:
    """Return the logarithm of how many ways there are to take so many of `count` [nats]."""
    return math.log(max(math.comb(count, taken), 1))
