"""The tests of one actuator in the order they were made, as the rows of a campaign tell them."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from datetime import date
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from actuator_glue.campaigns.first_stage import UNKNOWN
from actuator_glue.campaigns.rows import contents
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
        names: the parameters of Eq. (2) that some test tells, (p,).
        mean: of the logarithms, (n, p).
        covariance: of the logarithms, (n, p, p).
        groups: the tests of each day.
        left_out: tests without numbers that hold, and why, by group.
        untold: parameters that no test tells: each left them to the bounds of its prior.
    """

    actuator: str
    days: tuple[str, ...]
    times: Array
    names: tuple[str, ...]
    mean: Array
    covariance: Array
    groups: tuple[tuple[str, ...], ...]
    left_out: dict[str, str]
    untold: tuple[str, ...] = ()

    def until(self, count: int) -> Series:
        """Return the first `count` days."""
        return replace(
            self,
            days=self.days[:count],
            times=self.times[:count],
            mean=self.mean[:count],
            covariance=self.covariance[:count],
            groups=self.groups[:count],
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
    seen: dict[tuple[str, str], str] = {}
    for row in rows.to_dict('records'):
        group, numbers, files = str(row['group']), _numbers(row), contents(row)
        twice = next((seen[file] for file in sorted(files) if file in seen), None)
        if isinstance(numbers, str):
            left_out[group] = numbers
        elif twice is not None:
            left_out[group] = f'holds a file of {twice} again, which would count twice'
        else:
            seen |= dict.fromkeys(files, group)
            days.setdefault(str(row['day']), []).append((group, *numbers))
    if not days:
        raise InputError(
            f'{actuator}: none of its {len(rows)} tests has numbers that hold; '
            f'{next(iter(left_out.values()))}'
        )
    combined = [_combined([(m, c) for _, m, c in of]) for of in days.values()]
    mean, covariance = np.array([m for m, _ in combined]), np.array([c for _, c in combined])
    known = known_days(covariance)
    told = [i for i in range(len(NAMES)) if known[:, i].any()]
    if not told:
        raise InputError(
            f'{actuator}: none of its tests tells a parameter of Eq. (2): each leaves all of them '
            'to the bounds of its prior; calibrate tests of several stiffnesses together (`group` '
            'of the recipe)'
        )
    # What a day leaves open counts for nothing; there it stands with the days that tell it.
    for i in told:
        mean[~known[:, i], i] = np.median(mean[known[:, i], i])
    first = date.fromisoformat(next(iter(days)))
    return Series(
        actuator=actuator,
        days=tuple(days),
        times=np.array([(date.fromisoformat(d) - first).days for d in days], dtype=np.float64),
        names=tuple(NAMES[i] for i in told),
        mean=mean[:, told],
        covariance=covariance[:, told][:, :, told],
        groups=tuple(tuple(g for g, _, _ in of) for of in days.values()),
        left_out=left_out,
        untold=tuple(n for i, n in enumerate(NAMES) if i not in told),
    )


def known_days(covariance: Array) -> NDArray[np.bool_]:
    """Return which days tell which parameter, (n, p), by the days' covariances (n, p, p)."""
    return np.diagonal(covariance, axis1=1, axis2=2) < (0.1 * UNKNOWN) ** 2


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
