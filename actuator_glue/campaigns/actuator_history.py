"""The history of one actuator: what changed, since when, and what its next test will find."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from actuator_glue.api.given import seed_given
from actuator_glue.api.shown import Shown
from actuator_glue.campaigns.change_points import change_points
from actuator_glue.campaigns.day_left_out import left_out
from actuator_glue.campaigns.effect_spells import effect_histories
from actuator_glue.campaigns.history_data import HistoryData, Outlier
from actuator_glue.campaigns.pooling import Pooled, pooled
from actuator_glue.campaigns.rows import read_results
from actuator_glue.campaigns.series import Series, problems_of, series_of, tests_of
from actuator_glue.diagnosis.verdicts import COMPLETE
from actuator_glue.errors import InputError
from actuator_glue.given import number
from actuator_glue.given import path as path_given

if TYPE_CHECKING:
    from pandas import DataFrame

    from actuator_glue.report import html

_MOST = 100.0  # logarithm: farther off is no number to be told


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class ActuatorHistory(Shown, HistoryData):
    """What the tests of one actuator tell together, and its page."""

    def report(self, path: Path | str) -> Path:
        """Write the page of the actuator, one HTML file, and return its path.

        Raises:
            InputError: the file cannot be written.
        """
        from actuator_glue.campaigns.history_page import page  # draws: slow to import
        from actuator_glue.report import html
        from actuator_glue.report.page_name import page_path

        path = page_path(path)
        return html.write(path, page(self, path.resolve().parent))

    def brief(self) -> list[html.Block]:
        """Return the history in a sentence, changes, effects, the next test."""
        from actuator_glue.campaigns.history_page import brief

        return brief(self)


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
        seed: of the draws, 0 or more.
        results: the campaign's table where it has been read.

    Raises:
        InputError: no campaign there, no test of this actuator with a day and numbers, or a time
            or seed below zero.
    """
    seed = seed_given(seed)
    if ahead is not None and not 0.0 <= number(ahead, 'ahead') < np.inf:
        raise InputError(f'ahead is {ahead:g} days; give the days to the next test, 0 or more')
    table = tests_of(read_results(folder) if results is None else results, actuator)
    series = series_of(table, actuator)
    changes = change_points(series)
    together = pooled(series, changes, ahead, seed)
    rows = table.to_dict('records')
    return ActuatorHistory(
        actuator=actuator,
        folder=path_given(folder).resolve(),
        table=table,
        series=series,
        changes=changes,
        pooled=together,
        effects=effect_histories(
            [r for r in rows if r['verdict'] in COMPLETE and not problems_of(r)]
        ),
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
        elif group in where:
            reason = far[where[group]]
        elif not row.get('failure'):
            reason = series.left_out[group]
        if reason:
            report = reports[group] if isinstance(reports[group], str) else ''
            found.append(Outlier(group, str(row['day']), reason, str(report)))
    return tuple(found)


def _far(series: Series, together: Pooled) -> list[str]:
    """Return for each day why it is far from its level; empty where it is not."""
    found = left_out(series, together)
    told = []
    for t, outlier in enumerate(found.outliers):
        worst = int(np.argmin(found.p_values[t]))
        told.append(
            f'{series.names[worst]} {_off(float(found.deviation[t, worst]))} its level'
            if outlier
            else ''
        )
    return told


def _off(logarithm: float) -> str:
    """Say how far a number is from another: in percent, or how many times it is that."""
    if abs(logarithm) < 1.0:
        return f'{100.0 * np.expm1(logarithm):+.1f} % off'
    return f'{np.exp(min(logarithm, _MOST)):.2g} times'
