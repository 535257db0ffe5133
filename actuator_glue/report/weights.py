"""The explanations that an estimator carries, and their weights over time, as a table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from actuator_glue.errors import InputError
from actuator_glue.io.bag_reader import messages
from actuator_glue.io.messages import deserialize, full_name
from actuator_glue.online.stream import structure_weights

TITLE = 'Explanations and their weights over time, by the ends of windows'
HEADER = ('from [s]', 'to [s]', 'weights, at first -> at last')
ROWS = 20  # that are shown to people


@dataclass(frozen=True, slots=True)
class Spell:
    """A time in which the same explanations are carried, and the same one is the likeliest.

    Attributes:
        start_s: when that was known first [s].
        stop_s: when it was known last [s].
        first: weight of each explanation then, the likeliest first.
        last: the same at its end.
    """

    start_s: float
    stop_s: float
    first: Mapping[str, float]
    last: Mapping[str, float]

    def told(self) -> str:
        """Return the weights in words: `backlash 62 -> 97 %, Eq. (2) 38 -> 3 %`."""
        parts = []
        for name, weight in self.last.items():
            before, after = round(100 * self.first[name]), round(100 * weight)
            change = f'{after}' if before == after else f'{before} -> {after}'
            parts.append(f'{name} {change} %')
        return ', '.join(parts)


def spells(course: Sequence[tuple[float, Mapping[str, float]]]) -> list[Spell]:
    """Return the spells of a course of weights.

    Args:
        course: times [s], ascending, and the weights that were known then.
    """
    found: list[Spell] = []
    for time, given in course:
        weights = dict(sorted(given.items(), key=lambda item: -item[1]))
        last = found[-1] if found else None
        if (
            last is not None
            and set(last.last) == set(weights)
            and _first(last.last) == _first(weights)
        ):
            found[-1] = Spell(last.start_s, time, last.first, weights)
        else:
            found.append(Spell(time, time, weights, weights))
    return found


def of_bag(path: Path | str) -> dict[str, list[tuple[float, dict[str, float]]]]:
    """Return what live estimators carried: by topic, ends of windows [s] and weights.

    What cannot be read of a damaged bag is left out.

    Raises:
        InputError: no bag.
    """
    found: dict[str, list[tuple[float, dict[str, float]]]] = {}
    for one in messages(path, types={full_name('PosteriorMoments')}, note=lambda _: None):
        with suppress(InputError, ValueError):
            told = deserialize(one.type, one.data, one.definition)
            end = (int(told.index) + int(told.samples)) * float(told.period)
            found.setdefault(one.topic, []).append((end, dict(structure_weights(told))))
    return found


def rows(found: Sequence[Spell]) -> list[tuple[str, ...]]:
    """Return the last spells as rows of `HEADER`."""
    return [(f'{s.start_s:.1f}', f'{s.stop_s:.1f}', s.told()) for s in found[-ROWS:]]


def _first(weights: Mapping[str, float]) -> str:
    return next(iter(weights), '')
