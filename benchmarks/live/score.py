"""What a run of the live loop came to, held against the truth."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from benchmarks.live.cases import NOISE, RATE, Case, Streamed
from benchmarks.live.chain import Chain


def scored(case: Case, given: Streamed, ran: Chain) -> dict[str, Any]:
    """Return one stream's numbers.

    Intervals are mean and 1.96 standard deviations as published, of Eq. (2)'s parameters that a
    window identifies, in windows from the first addition on; of a healthy machine in all.
    """
    inside: list[bool] = []
    weights: list[float] = []
    covered: list[float] = []
    errors: list[float] = []
    rate = case.drift / case.seconds + given.sizes.get('gain_drift', 0.0)
    truth, proposed = frozenset(case.effects), False
    first = ran.added if case.effects else 0.0
    for result in ran.results:
        end = result.window.end / RATE
        for band in result.scored:
            if band.kind == 'total' and band.coverage is not None:
                covered.append(float(band.coverage[-1]))
                errors.append(band.rms_error)
        told = dict(zip(map(frozenset, result.structures), result.weights, strict=True))
        proposed = proposed or (bool(truth) and truth in told)
        if proposed:
            weights.append(told.get(truth, 0.0))
        if not end >= first or result.moments is None:
            continue
        theta = given.theta.copy()
        # A model that has the drift itself has the gain at the window's beginning.
        own = 'gain-drift' in result.model.effects
        at = end - (1.0 if own else 0.5) * len(result.window.record) / RATE
        theta[1] *= 1.0 + rate * at
        mean, sd = result.moments.mean[:4], result.moments.stddev[:4]
        known = ~np.array(result.prior_dominated[:4])
        inside += (np.abs(mean - theta) <= 1.96 * sd)[known].tolist()
    last = ran.results[-1]
    return {
        'inside': float(np.mean(inside)) if inside else np.nan,
        'windows': len(inside),
        'true_weight': weights[-1] if weights else 0.0,
        'true_least': min(weights) if weights else np.nan,
        'leading': list(last.structures[0]),
        'right': frozenset(last.structures[0]) == truth,
        'coverage': float(np.mean(covered)),
        'error': float(np.sqrt(np.mean(np.square(errors[-20:])))) / NOISE,
        'broke': ran.broke,
        'added': ran.added,
        'delay': ran.added - ran.broke,
        'removed': ran.removed,
        'proposals': [[at, [list(s) for s in what]] for at, what in ran.proposals],
        'looks': ran.looks,
    }


def table(rows: Sequence[dict[str, Any]]) -> str:
    """Return the streams and their summary as a table for people."""
    head = (
        'hidden',
        'ratio',
        'calibration',
        'first added after break [s]',
        'truth inside',
        'true weight at end (least)',
        'largest weight at end',
        'forecasts covered',
        'error/noise',
        'looks',
    )
    lines = ['| ' + ' | '.join(head) + ' |', '|' + '---|' * len(head)]
    for row in sorted(rows, key=lambda r: r['seed']):
        cells = (
            ' + '.join(row['effects']) or 'nothing',
            f'{row["ratio"]:g}' if row['effects'] else '',
            'yes' if row['calibrated'] else 'no',
            f'{row["delay"]:.0f}',
            f'{row["inside"]:.0%}',
            f'{row["true_weight"]:.2f} ({row["true_least"]:.2f})',
            ' + '.join(row['leading']) or 'Eq. (2)',
            f'{row["coverage"]:.1%}',
            f'{row["error"]:.2f}',
            str(row['looks']),
        )
        lines.append('| ' + ' | '.join(cells) + ' |')
    hidden = [row for row in rows if row['effects']]
    healthy = [row for row in rows if not row['effects']]
    counted = sum(row['windows'] for row in hidden)
    lines.append('')
    if counted:
        inside = sum(row['inside'] * row['windows'] for row in hidden if row['windows'])
        lines.append(
            f'- intervals that hold the truth after the first addition: '
            f'{inside / counted:.1%} of {counted}'
        )
    if hidden:
        right = np.mean([row['right'] for row in hidden])
        delays = [row['delay'] for row in hidden if np.isfinite(row['delay'])]
        median = f'{np.median(delays):.0f} s' if delays else 'none'
        lines.append(f'- true structure has the largest weight at the end: {right:.0%}')
        lines.append(f'- first addition after the coverage broke, median: {median}')
    added = sum(bool(np.isfinite(row['added'])) for row in healthy)
    lines.append(f'- healthy machines with an addition: {added} of {len(healthy)}')
    return '\n'.join(lines) + '\n'
