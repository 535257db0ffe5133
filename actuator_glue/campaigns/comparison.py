"""Two tests or stretches of days of one actuator side by side: is it another machine."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from scipy.stats import norm

from actuator_glue.api.shown import Shown
from actuator_glue.campaigns.actuator_history import ActuatorHistory, history
from actuator_glue.campaigns.day_model import walked
from actuator_glue.campaigns.rows import read_results
from actuator_glue.campaigns.series import actuators_of, known_days
from actuator_glue.errors import InputError
from actuator_glue.records import Array

if TYPE_CHECKING:
    from actuator_glue.report import html

# p-value of all parameters together below which two sides are of different machines.
DIFFERENT = 0.01
_TOLD = 5  # shared days that an error names
HEADER = ('parameter', 'B over A', '2.5 %', '97.5 %', 'ageing, scatter', 'p')


@dataclass(frozen=True, slots=True)
class ParameterDifference:
    """One parameter of B over that of A.

    Attributes:
        name: the parameter.
        ratio, lower, upper: B over A with its 95 % limits, each side's posterior in them.
        usual: standard deviation of the ratio's logarithm that ageing between the sides and
            scatter of days alone make.
        p_value: of such a difference between days of one machine.
    """

    name: str
    ratio: float
    lower: float
    upper: float
    usual: float
    p_value: float

    def row(self) -> tuple[str, ...]:
        """Return it under HEADER."""
        numbers = (f'{v:.4f}' for v in (self.ratio, self.lower, self.upper))
        return (self.name, *numbers, f'{100.0 * self.usual:.2g} %', f'{self.p_value:.2g}')


@dataclass(frozen=True, slots=True, repr=False)
class DaysCompared(Shown):
    """Two sides of one actuator.

    Attributes:
        actuator: its name.
        a, b: the days of each side.
        differences: of each parameter.
        different: whether the sides differ by more than days of one machine do.
        notes: what the history says of the sides: its changes between them or within one, and
            their days that are out of line.
    """

    more = 'the attributes hold them'

    actuator: str
    a: tuple[str, ...]
    b: tuple[str, ...]
    differences: tuple[ParameterDifference, ...]
    different: bool
    notes: tuple[str, ...] = ()

    def brief(self) -> list[html.Block]:
        """Return the answer, the differences, and what the history says of the sides."""
        from actuator_glue.report import html

        rows = [d.row() for d in self.differences]
        sides = f'B: {_told(self.b)}; A: {_told(self.a)}'
        table = html.Table(HEADER, rows, sides)
        return [html.Text(self.summary()), table, *map(html.Note, self.notes)]

    def summary(self) -> str:
        """Return the answer in one line."""
        if not self.different:
            return f'{self.actuator}: no difference beyond ageing and scatter of days'
        worst = min(self.differences, key=lambda d: d.p_value)
        return (
            f'{self.actuator}: another machine: {worst.name} {100.0 * (worst.ratio - 1.0):+.1f} % '
            f'(p {worst.p_value:.2g} for days of one machine)'
        )


def _told(days: tuple[str, ...]) -> str:
    """Say which days a side has."""
    return days[0] if len(days) == 1 else f'{days[0]} to {days[-1]} ({len(days)} days of test)'


def compare(folder: Path | str, a: str, b: str, *, actuator: str | None = None) -> DaysCompared:
    """Compare two days, tests or stretches of days of one actuator.

    Args:
        folder: of a campaign.
        a: a day (2026-03-01), a stretch (2026-03-01:2026-03-31), or the name of a test.
        b: the other side.
        actuator: whose; None where the campaign has one, or the test's name says it.

    Raises:
        InputError: no such test, no day of test there, sides of two actuators, or sides that share
            tests.
    """
    if actuator is None:
        actuator = _named(folder, (a, b))
    found = history(folder, actuator)
    sides = [_side(found, text) for text in (a, b)]
    _apart(found, (a, b), sides)
    means, covariances = zip(*(_mean(found, side) for side in sides), strict=True)
    step = means[1] - means[0]
    spread = np.sqrt(np.diag(covariances[0] + covariances[1]))
    usual = _usual(found, sides)
    p_values = 2.0 * norm.sf(np.abs(step) / np.hypot(spread, usual))
    differences = tuple(
        ParameterDifference(
            name=name,
            ratio=float(np.exp(step[i])),
            lower=float(np.exp(step[i] - 1.96 * spread[i])),
            upper=float(np.exp(step[i] + 1.96 * spread[i])),
            usual=float(usual[i]),
            p_value=float(p_values[i]),
        )
        for i, name in enumerate(found.series.names)
    )
    days = [tuple(found.series.days[i] for i in side) for side in sides]
    # Bonferroni over the parameters.
    different = bool(p_values.min() * len(p_values) < DIFFERENT)
    return DaysCompared(actuator, days[0], days[1], differences, different, _notes(found, sides))


def _notes(found: ActuatorHistory, sides: Sequence[list[int]]) -> tuple[str, ...]:
    """Return the changes between two sides or within one, and days of theirs out of line."""
    notes = []
    for change in found.changes:
        parts = [{day >= change.place for day in side} for side in sides]
        where = [f'within {name}' for name, part in zip('AB', parts, strict=True) if len(part) > 1]
        if not where and parts[0] != parts[1]:
            where = ['between A and B']
        if where:
            moved = ', '.join(change.moved) or 'no parameter alone'
            notes.append(
                f'the history has a change {" and ".join(where)}: {change.day} ({moved}, '
                f'probability {change.probability:.3f})'
            )
    if found.series.untold:
        notes.append(f'no test tells {", ".join(found.series.untold)}: not compared')
    groups = {g for side in sides for day in side for g in found.series.groups[day]}
    notes += [f'{o.group} is out of line: {o.reason}' for o in found.outliers if o.group in groups]
    return tuple(notes)


def _named(folder: Path | str, sides: Sequence[str]) -> str:
    table = read_results(folder)
    of = {str(g): str(x) for g, x in zip(table['group'], table['actuator'], strict=True)}
    said = {of[side] for side in sides if side in of}
    every = said or set(actuators_of(table))
    if len(every) != 1:
        raise InputError(
            f'whose days? The campaign has {", ".join(sorted(every)) or "no actuator with days"}; '
            'name one with --actuator'
        )
    return every.pop()


def _side(found: ActuatorHistory, text: str) -> list[int]:
    """Return the numbers of the days of one side."""
    series = found.series
    if text in found.series.left_out:
        raise InputError(f'{text}: {series.left_out[text]}; nothing can be compared with it')
    first, _, last = text.partition(':')
    side = [
        i
        for i, (day, groups) in enumerate(zip(series.days, series.groups, strict=True))
        if text in groups or first <= day <= (last or first)
    ]
    if not side:
        raise InputError(
            f'{text}: {found.actuator} has no such test and no day of test there; its days go '
            f'from {series.days[0]} to {series.days[-1]}'
        )
    return side


def _apart(found: ActuatorHistory, texts: Sequence[str], sides: Sequence[list[int]]) -> None:
    """Check that no day is on both sides: its scatter would count as two independent ones.

    Raises:
        InputError: one is.
    """
    shared = [found.series.days[i] for i in sides[0] if i in set(sides[1])]
    if shared:
        days = ', '.join(shared[:_TOLD])
        more = f' and {len(shared) - _TOLD} more' if len(shared) > _TOLD else ''
        raise InputError(
            f'{texts[0]} and {texts[1]} share {days}{more}: all tests of a day are one estimate, '
            'which can be on one side only; choose sides without a common day'
        )


def _mean(found: ActuatorHistory, side: list[int]) -> tuple[Array, Array]:
    """Return the mean of some days' estimates, and its covariance by their posteriors."""
    series, weights = found.series, _weights(found, side)
    covariance = np.einsum('np,npq,nq->pq', weights, series.covariance[side], weights)
    return (weights * series.mean[side]).sum(axis=0), covariance


def _weights(found: ActuatorHistory, side: list[int]) -> Array:
    """Return the weight of each day of a side in the mean of each parameter, (days, p).

    Days that tell it count alike; where none does all stand for that.
    """
    known = known_days(found.series.covariance[side]).astype(np.float64)
    known[:, ~known.any(axis=0)] = 1.0
    return np.asarray(known / known.sum(axis=0))


def _usual(found: ActuatorHistory, sides: Sequence[list[int]]) -> Array:
    """Return the standard deviation of the sides' difference between days of one machine, (p,).

    The level walks between the sides and within them, and each day has an offset. Jumps are no
    part of it: they are what makes another machine. Medians of walk and offset do: the difference
    itself is among the days that tell them, and makes both larger where they are hardly known.
    """
    weights = np.zeros(found.series.mean.shape)
    for side, sign in zip(sides, (-1.0, 1.0), strict=True):
        weights[side] = sign * _weights(found, side)
    ageing = found.pooled.walk * np.sqrt([walked(found.series.times, w) for w in weights.T])
    offsets = found.pooled.offset * np.sqrt((weights**2).sum(axis=0))
    return np.asarray(np.hypot(ageing, offsets))
