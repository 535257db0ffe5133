"""What the tests of one actuator tell together, in numbers."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from actuator_glue.api.pooled_prior import PooledPrior
from actuator_glue.campaigns.change_points import ChangePoint
from actuator_glue.campaigns.effect_spells import EffectHistory
from actuator_glue.campaigns.pooling import Pooled
from actuator_glue.campaigns.series import Series
from actuator_glue.json_value import json_value

if TYPE_CHECKING:
    from pandas import DataFrame


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
class HistoryData:
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
                'untold': list(self.series.untold),
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
                        'units': {n: unit for n, unit, *_ in e.sizes},
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
                'outliers': self.outliers,
            }
        )
        return value
