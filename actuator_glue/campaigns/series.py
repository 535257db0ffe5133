"""The tests of one actuator in the order they were made, as the rows of a campaign tell them."""

from __future__ import annotations

import json
from dataclasses import dataclass
from datetime import date
from typing import TYPE_CHECKING, Any

import numpy as np

from actuator_glue.diagnosis.verdicts import COMPLETE
from actuator_glue.errors import InputError
from actuator_glue.model.parameters import NAMES
from actuator_glue.records import Array

if TYPE_CHECKING:
    from pandas import DataFrame


@dataclass(frozen=True, slots=True, eq=False)
class Series:
    """What is known of one actuator's parameters on each day of test.

    Tests of one day have one machine: their estimates are one, weighted by what each knows.

    Attributes:
        actuator: its name.
        days: dates of the days, ISO 8601, (n,).
        times: days since the first one, (n,).
        names: the parameters of Eq. (2), (p,).
        mean: of the logarithms, (n, p).
        covariance: of the logarithms, (n, p, p).
        groups: the tests of each day.
        left_out: tests without numbers that hold, and why, by group.
    """

    actuator: str
    days: tuple[str, ...]
    times: Array
    names: tuple[str, ...]
    mean: Array
    covariance: Array
    groups: tuple[tuple[str, ...], ...]
    left_out: dict[str, str]

    def until(self, count: int) -> Series:
        """Return the first `count` days."""
        return Series(
            self.actuator,
            self.days[:count],
            self.times[:count],
            self.names,
            self.mean[:count],
            self.covariance[:count],
            self.groups[:count],
            self.left_out,
        )


def actuators_of(table: DataFrame) -> list[str]:
    """Return the actuators that have a test with a day, sorted."""
    known = table[table['day'].notna() & table['actuator'].notna()]
    return sorted({str(name) for name in known['actuator']})


def tests_of(table: DataFrame, actuator: str) -> DataFrame:
    """Return the rows of one actuator that have a day, in their order.

    Raises:
        InputError: none has.
    """
    rows = table[(table['actuator'] == actuator) & table['day'].notna()]
    if not len(rows):
        known = ', '.join(actuators_of(table)) or 'none'
        raise InputError(
            f'no test of actuator {actuator!r} has a day; actuators with days are: {known}'
        )
    return rows.sort_values(['day', 'started', 'group'], kind='stable')


def series_of(table: DataFrame, actuator: str) -> Series:
    """Return the days of one actuator.

    Args:
        table: of a campaign, see `read_results`.
        actuator: its name.

    Raises:
        InputError: no test of it has a day and numbers.
    """
    rows = tests_of(table, actuator)
    left_out: dict[str, str] = {}
    days: dict[str, list[tuple[str, Array, Array]]] = {}
    for row in rows.to_dict('records'):
        told = _numbers(row)
        if isinstance(told, str):
            left_out[str(row['group'])] = told
        else:
            days.setdefault(str(row['day']), []).append((str(row['group']), *told))
    if not days:
        raise InputError(
            f'{actuator}: none of its {len(rows)} tests has numbers that hold; '
            f'{next(iter(left_out.values()))}'
        )
    combined = [_combined([(m, c) for _, m, c in of]) for of in days.values()]
    first = date.fromisoformat(next(iter(days)))
    return Series(
        actuator=actuator,
        days=tuple(days),
        times=np.array([(date.fromisoformat(d) - first).days for d in days], dtype=np.float64),
        names=NAMES,
        mean=np.array([m for m, _ in combined]),
        covariance=np.array([c for _, c in combined]),
        groups=tuple(tuple(g for g, _, _ in of) for of in days.values()),
        left_out=left_out,
    )


def problems_of(row: dict[str, Any]) -> str:
    """Return why the posterior of a test must not be used; empty where it may.

    A complete diagnosis has answered those of the calibration. `converged` is no such reason: it
    is of the calibration alone, and its posterior counts as reached up to a larger R-hat.

    Args:
        row: of a campaign; older tables have no column `problems`, joined ones may have gaps.
    """
    told = row.get('problems')
    return told if isinstance(told, str) else ''


def _numbers(row: dict[str, Any]) -> tuple[Array, Array] | str:
    """Return mean and covariance of the logarithms, or why there are none that hold."""
    if row.get('failure'):
        return str(row['failure'])
    if row['verdict'] not in COMPLETE:
        return f'verdict {row["verdict"]}: its intervals do not hold'
    if reason := problems_of(row):
        return reason
    text = row.get('pooling')
    value = json.loads(text) if isinstance(text, str) else None
    if value is None or tuple(value['names']) != NAMES:
        return 'its draws are of other parameters, or reach zero'
    return np.array(value['mean']), np.array(value['covariance'])


def _combined(estimates: list[tuple[Array, Array]]) -> tuple[Array, Array]:
    """Return the product of normals: mean and covariance of what all of them say."""
    if len(estimates) == 1:
        return estimates[0]
    precisions = [np.linalg.inv(c) for _, c in estimates]
    covariance = np.linalg.inv(sum(precisions))
    weighted = sum(p @ m for p, (m, _) in zip(precisions, estimates, strict=True))
    return covariance @ weighted, covariance
