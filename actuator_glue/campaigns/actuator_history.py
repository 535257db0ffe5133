"""The history of one actuator: what changed, since when, and what its next test will find."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.stats import chi2

from actuator_glue.api.pooled_prior import PooledPrior
from actuator_glue.campaigns.change_points import ChangePoint, change_points
from actuator_glue.campaigns.effect_spells import EffectHistory, effect_histories
from actuator_glue.campaigns.pooling import Pooled, pooled
from actuator_glue.campaigns.rows import read_results
from actuator_glue.campaigns.series import Series, series_of, tests_of
from actuator_glue.diagnosis.held_out import COMPLETE
from actuator_glue.json_value import json_value

if TYPE_CHECKING:
    from pandas import DataFrame

# A day is an outlier where chance puts one of as many days so far out in one of 20 histories.
_OUTLIERS = 0.05
_MOST = 100.0  # logarithm: farther off is no number to be told


@dataclass(frozen=True, slots=True)
class Outlier:
    """A test that stands out.

    Attributes:
        group: the test.
        day: of it.
        reason: why, for people.
        report: its report below the campaign's folder; empty where there is none.
    """

    group: str
    day: str
    reason: str
    report: str


@dataclass(frozen=True, slots=True, eq=False)
class ActuatorHistory:
    """What the tests of one actuator tell together.

    Attributes:
        actuator: its name.
        folder: of the campaign.
        table: its rows with a day, in their order.
        series: its days.
        changes: when it was changed.
        pooled: its level, its days, its next test.
        effects: what came and went.
        outliers: tests that stand out.
    """

    schema = 'actuator_glue.history/1'

    actuator: str
    folder: Path
    table: DataFrame
    series: Series
    changes: tuple[ChangePoint, ...]
    pooled: Pooled
    effects: tuple[EffectHistory, ...]
    outliers: tuple[Outlier, ...]

    @property
    def prior(self) -> PooledPrior:
        """What is known of the next test, as `--prior` takes it."""
        last = self.series.days[-1]
        return PooledPrior(
            names=self.pooled.names,
            draws=self.pooled.next_draws,
            source=f'{len(self.series.days)} days of {self.actuator} until {last}',
        )

    def change_sizes(self, change: ChangePoint) -> dict[str, tuple[float, float, float]]:
        """Return by how much each parameter's level changed: ratio and its 95 % limits."""
        k, p = change.place, self.pooled
        step = p.level[k] - p.level[k - 1]
        spread = 1.96 * np.hypot(p.level_stddev[k], p.level_stddev[k - 1])
        return {
            n: (float(np.exp(d)), float(np.exp(d - s)), float(np.exp(d + s)))
            for n, d, s in zip(p.names, step, spread, strict=True)
        }

    def to_json(self) -> dict[str, Any]:
        """Return the object of schema `actuator_glue.history/1`."""
        low, high = self.pooled.next_interval()
        middle = np.median(self.pooled.next_draws, axis=0)
        value: dict[str, Any] = json_value(
            {
                'schema': self.schema,
                'actuator': self.actuator,
                'tests': len(self.table),
                'days': list(self.series.days),
                'left_out': self.series.left_out,
                'changes': [
                    {
                        'day': c.day,
                        'earliest': c.earliest,
                        'latest': c.latest,
                        'probability': c.probability,
                        'parameters': c.parameters,
                        'ratios': self.change_sizes(c),
                    }
                    for c in self.changes
                ],
                'effects': [
                    {
                        'name': e.name,
                        'spells': [[s.begin, s.end, s.days] for s in e.spells],
                        'sizes': {n: [m, lo, hi] for n, _, m, lo, hi in e.sizes},
                        'probability_next': e.probability_next,
                    }
                    for e in self.effects
                ],
                'next_test': {
                    n: {'median': middle[i], 'lower': low[i], 'upper': high[i]}
                    for i, n in enumerate(self.pooled.names)
                },
                'days_ahead': self.pooled.ahead,
                'scatter_of_days': dict(zip(self.pooled.names, self.pooled.offset, strict=True)),
                'outliers': [
                    {'group': o.group, 'day': o.day, 'reason': o.reason, 'report': o.report}
                    for o in self.outliers
                ],
            }
        )
        return value

    def report(self, path: Path | str) -> Path:
        """Write the page of the actuator, one HTML file, and return its path.

        Raises:
            InputError: the file cannot be written.
        """
        from actuator_glue.campaigns.history_page import page
        from actuator_glue.report import html

        return html.write(Path(path), page(self, Path(path).resolve().parent))


def history(
    folder: Path | str,
    actuator: str,
    *,
    ahead: float | None = None,
    seed: int = 1,
    results: DataFrame | None = None,
) -> ActuatorHistory:
    """Return the history of an actuator from the table of a campaign; nothing is tested again.

    Args:
        folder: of the campaign.
        actuator: its name.
        ahead: days from the last test to the next one; None for as many as between tests so far.
        seed: of the draws.
        results: the campaign's table where it has been read.

    Raises:
        InputError: no campaign there, or no test of this actuator with a day and numbers.
    """
    table = tests_of(read_results(folder) if results is None else results, actuator)
    series = series_of(table, actuator)
    changes = change_points(series)
    together = pooled(series, changes, ahead, seed)
    rows = table.to_dict('records')
    return ActuatorHistory(
        actuator=actuator,
        folder=Path(folder).resolve(),
        table=table,
        series=series,
        changes=changes,
        pooled=together,
        effects=effect_histories([r for r in rows if r['verdict'] in COMPLETE]),
        outliers=_outliers(rows, series, together),
    )


def _outliers(rows: list[dict[str, Any]], series: Series, together: Pooled) -> tuple[Outlier, ...]:
    found = []
    reports = {str(r['group']): r.get('report') for r in rows}
    far = _far(series, together)
    where = {g: i for i, groups in enumerate(series.groups) for g in groups}
    for row in rows:
        group = str(row['group'])
        reason = ''
        if not row.get('failure') and row['verdict'] not in COMPLETE:
            reason = f'verdict {row["verdict"]}: more is left than the model tells'
        elif group in where and far[where[group]]:
            reason = far[where[group]]
        if reason:
            report = reports[group] if isinstance(reports[group], str) else ''
            found.append(Outlier(group, str(row['day']), reason, str(report)))
    return tuple(found)


def _far(series: Series, together: Pooled) -> list[str]:
    """Return for each day why it is far from its level; empty where it is not."""
    n, p = series.mean.shape
    limit = float(chi2.isf(1.0 - (1.0 - _OUTLIERS) ** (1.0 / n), p))
    told = []
    for t in range(n):
        scatter = series.covariance[t] + np.diag(together.offset**2)
        # The level as all other days tell it.
        own, whole = np.diag(scatter), together.level_stddev[t] ** 2
        others = 1.0 / np.maximum(1.0 / whole - 1.0 / own, 1e-3 / own)
        level = others * (together.level[t] / whole - series.mean[t] / own)
        spread = scatter + np.diag(others)
        deviation = series.mean[t] - level
        distance = float(deviation @ np.linalg.solve(spread, deviation))
        worst = int(np.argmax(np.abs(deviation) / np.sqrt(np.diag(spread))))
        told.append(
            f'{series.names[worst]} {_off(float(deviation[worst]))} its level'
            if distance > limit
            else ''
        )
    return told


def _off(logarithm: float) -> str:
    """Say how far a number is from another: in percent, or how many times it is that."""
    if abs(logarithm) < 1.0:
        return f'{100.0 * np.expm1(logarithm):+.1f} % off'
    return f'{np.exp(min(logarithm, _MOST)):.2g} times'
