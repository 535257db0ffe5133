"""One weight for every structure: what it leaves in units of what matters, and what it costs.

    log w = -e^2 / s^2 - p - log(structures of its kind that could have been tried)

e is the rms error of blocks left out, p the number of parameters, s a twentieth of what matters: a
coarsened posterior (Miller & Dunson 2019, J. Am. Stat. Assoc. 114:1113). With minutes of samples
nats of independent noise tell any two equations apart, and neither of them is the machine's:
differences count in units of what matters. Nats answer one question only: is it there beyond
chance.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from actuator_glue.diagnosis.learned.term import is_learned
from actuator_glue.model.effects import Effect
from actuator_glue.model.structure import Structure

# Error that costs a nat, of what matters: a tenth of that costs four. With twice of it friction's
# shape was lost, and with ten times a delay was not told from a lag.
TELLING = 0.05


def log_weight(left_out: float, tells: float, cost: float) -> float:
    """Return the logarithm of a structure's weight, up to what all have in common [nats].

    Args:
        left_out: rms error of blocks left out [m].
        tells: rms error that costs a nat, `TELLING` of what matters [m].
        cost: its price [nats].
    """
    return -((left_out / tells) ** 2) - cost


def price(structure: Structure, entries: Mapping[str, Effect], named: int) -> float:
    """Return what a structure costs beside what it leaves [nats].

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
