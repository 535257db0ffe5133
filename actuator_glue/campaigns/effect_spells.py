"""Effects over the days of an actuator: when each was there, how large, and whether it will be."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.stats import t as student

from actuator_glue.campaigns.rows import BETWEEN
from actuator_glue.model.effects import CATALOGUE


@dataclass(frozen=True, slots=True)
class EffectSpell:
    """A run of days on each of which an effect was found.

    Attributes:
        begin, end: first and last day, ISO 8601.
        days: of test among them.
    """

    begin: str
    end: str
    days: int


@dataclass(frozen=True, slots=True)
class EffectHistory:
    """One effect over the days of one actuator.

    Attributes:
        name: of it, as diagnoses told it.
        meaning: what it is, for people; empty for one that the catalogue does not hold.
        remedy: what to check or to do about it, likewise.
        spells: when it was there.
        sizes: parameter, its unit, and mean, lower and upper 95 % limit of the size that a test
            of one more day tells where it is there.
        probability_next: that the next test will find it: it comes and goes between days of test
            with chances that all days tell (a Markov chain, Jeffreys priors).
    """

    name: str
    meaning: str
    remedy: str
    spells: tuple[EffectSpell, ...]
    sizes: tuple[tuple[str, str, float, float, float], ...]
    probability_next: float

    @property
    def there(self) -> bool:
        """Whether the next test will find it, as likely as not."""
        return self.probability_next >= 0.5


def effect_histories(rows: Sequence[dict[str, Any]]) -> tuple[EffectHistory, ...]:
    """Return every effect that some test of an actuator found.

    Args:
        rows: of its tests that did not fail, in their order.
    """
    days: dict[str, set[str]] = {}
    for row in rows:
        named = {n for n in str(row.get('effects') or '').split(BETWEEN) if n}
        days.setdefault(str(row['day']), set()).update(named)
    every = sorted(set().union(*days.values())) if days else []
    return tuple(_history(name, days, rows) for name in every)


def _history(
    name: str, days: dict[str, set[str]], rows: Sequence[dict[str, Any]]
) -> EffectHistory:
    found = [name in named for named in days.values()]
    spells: list[EffectSpell] = []
    for at, (day, there) in enumerate(zip(days, found, strict=True)):
        if there and at and found[at - 1]:
            spells[-1] = EffectSpell(spells[-1].begin, day, spells[-1].days + 1)
        elif there:
            spells.append(EffectSpell(day, day, 1))
    steps = list(pairwise(found))
    after = [b for a, b in steps if a == found[-1]]
    entry = CATALOGUE.get(name)
    parameters = () if entry is None else entry.parameters
    return EffectHistory(
        name=name,
        meaning='' if entry is None else entry.meaning,
        remedy='' if entry is None else entry.remedy,
        spells=tuple(spells),
        sizes=tuple(
            size for p in parameters if (size := _size(p.name, p.unit, name, rows)) is not None
        ),
        probability_next=(sum(after) + 0.5) / (len(after) + 1.0),
    )


def _size(
    parameter: str, unit: str, effect: str, rows: Sequence[dict[str, Any]]
) -> tuple[str, str, float, float, float] | None:
    """Return mean and 95 % limits of the size that a test of one more day will tell.

    What it tells differs from the mean by the scatter of days, by its own posterior and by the
    mean's error. The spread of the means so far has each posterior in it already, so that only
    what is beyond these is scatter of days. That of few days is hardly known: Student's t, with
    degrees of freedom as of Satterthwaite (1946), since posteriors are known. One day tells no
    scatter; the limits are then as if days had none.
    """
    there = [
        r
        for r in rows
        if effect in str(r.get('effects') or '').split(BETWEEN)
        and np.isfinite(r.get(f'{parameter}_mean') or np.nan)
    ]
    if not there:
        return None
    means = np.array([r[f'{parameter}_mean'] for r in there])
    widths = np.array([r[f'{parameter}_upper'] - r[f'{parameter}_lower'] for r in there])
    n, within = len(means), float(np.mean((widths / (2.0 * 1.96)) ** 2))
    days = max(float(means.var(ddof=1)) - within, 0.0) if n > 1 else 0.0
    freedom = (n - 1) * ((within + days) / days) ** 2 if days else np.inf
    spread = float(student.isf(0.025, freedom)) * np.sqrt((within + days) * (1.0 + 1.0 / n))
    middle = float(means.mean())
    return parameter, unit, middle, middle - float(spread), middle + float(spread)
