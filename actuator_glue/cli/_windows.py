"""Windows of a replay: a table for people, numbers for JSON."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from actuator_glue.cli._output import table

if TYPE_CHECKING:
    from actuator_glue.online.job import WindowResult

ROWS = 20  # windows shown to people; JSON has all


def show(windows: list[dict[str, Any]], args: argparse.Namespace) -> None:
    """Print posterior and errors of the windows, evenly thinned."""
    if not windows:
        return
    names = list(windows[-1]['parameters'])
    shown = [w for w in windows if list(w['parameters']) == names]
    if len(shown) > ROWS:
        shown = [shown[i * (len(shown) - 1) // (ROWS - 1)] for i in range(ROWS)]
    rows = []
    for w in shown:
        parameters = list(w['parameters'].values())
        coverage = [b['coverage'][-1] for b in w['bands'] if b['kind'] == 'total']
        rows.append(
            (
                str(w['window']),
                f'{w["end_s"]:.2f}',
                *(f'{p["mean"]:.4g} {_percent(p["stddev"], p["mean"])}' for p in parameters),
                f'{max(p["rhat"] for p in parameters):.2f}',
                f'{1e6 * w["error"]["rms_m"]:.1f}',
                f'{100 * coverage[-1]:.0f} %' if coverage else '-',
            )
        )
    columns = ('window', 'end [s]', *names, 'R-hat', 'rms [um]', 'cover')
    title = 'Posterior mean (SI units) and standard deviation (% of it) of each window'
    table(title, columns, rows, args)


def _percent(stddev: float, mean: float) -> str:
    return f'{100 * stddev / abs(mean):3.0f}%' if mean else '  -%'


def numbers(r: WindowResult) -> dict[str, Any]:
    """Return what is kept of a window: its samples and bands are many."""
    assert r.moments is not None and r.rhat is not None and r.ess is not None
    record, m = r.window.record, r.moments
    columns = {'mean': m.mean, 'stddev': m.stddev, 'skewness': m.skewness, 'cov': m.cov}
    columns |= {'rhat': r.rhat, 'ess': r.ess}
    return {
        'window': r.window.number,
        'index': record.first_index,
        'samples': len(record),
        'end_s': (record.first_index + len(record)) * record.period,
        'parameters': {
            name: {key: values[i] for key, values in columns.items()}
            for i, name in enumerate(r.model.names)
        },
        'evaluations': r.evaluations,
        'converged': r.converged,
        'error': {'rms_m': r.rms_error, 'nrmse': r.nrmse},
        'bands': [
            {
                'kind': p.kind,
                'index': p.index,
                'levels': p.band.levels,
                'coverage': p.coverage,
                'width_m': p.width,
            }
            for p in r.scored
        ],
    }
