"""Tables of what posteriors predict: coverage, histograms, scores."""

from __future__ import annotations

import numpy as np

from studies.chen.experiment import stiffness_name
from studies.chen.published import CLOSE_UPS
from studies.chen.responses import CLOSE, QUANTITIES, UNITS, quantity
from studies.chen.study import Results
from studies.chen.table import StudyTable
from studies.chen.words import BANDS


def frequency_coverage(results: Results) -> StudyTable:
    """Return how much of the experimental response the bands cover."""
    keys = [f'{q} in {b} [1]' for q in QUANTITIES for b in ('95 %', 'all draws')]
    rows = []
    for kind, bands in results.frequency.items():
        for test, band in enumerate(bands):
            shares = [
                float(inside.mean())
                for q in QUANTITIES
                for inside in (band[q].inside, band[q].inside_all)
            ]
            rows.append((f'{stiffness_name(test)}, {BANDS[kind]}', *shares))
    return StudyTable(('test, band', *keys), rows)


def displacement_coverage(results: Results) -> StudyTable:
    """Return how many measured samples the bands cover near 1, 5 and 10 Hz."""
    rows = [
        (f'{stiffness_name(test)}, {BANDS[kind]}', *band.near, band.scores[0].coverage)
        for kind, bands in results.time.items()
        for test, band in enumerate(bands)
    ]
    return StudyTable(
        ('test, band', *(f'{f:g} ± 0.5 Hz [1]' for f in CLOSE_UPS), 'whole [1]'), rows
    )


def histograms(results: Results) -> StudyTable:
    """Return the distributions of amplitude and phase at 1, 5 and 10 Hz, matched residual."""
    keys = (
        'quantity',
        'all draws, from',
        'all draws, to',
        '95 %, from',
        '95 %, to',
        'experiment',
        'Eqs. (3a), (3b)',
        'Table 2',
        'draws below the experiment [1]',
    )
    rows = []
    for test, curves in enumerate(results.curves):
        for name in QUANTITIES:
            draws = results.frequency['matched'][test][name].draws
            lines = [quantity(name, curves[k]) for k in ('experiment', 'identified', 'Table 2')]
            for f, at in zip(CLOSE_UPS, CLOSE, strict=True):
                rows.append(
                    (
                        f'{stiffness_name(test)}, {name} [{UNITS[name]}], {f:g} Hz',
                        *np.quantile(draws[:, at], (0.0, 1.0, 0.025, 0.975)),
                        *(line[at] for line in lines),
                        float(np.mean(draws[:, at] <= lines[0][at])),
                    )
                )
    return StudyTable(keys, rows)


def scores(results: Results) -> StudyTable:
    """Return the scores of every displacement band by frequency."""
    keys = (
        'test, band',
        'from [Hz]',
        'to [Hz]',
        'samples',
        'coverage (PICP) [1]',
        'mean width [m]',
        'CRPS [m]',
        'interval score [m]',
    )
    rows = [
        (
            f'{stiffness_name(test)}, {BANDS[kind]}',
            s.low_hz,
            min(s.high_hz, CLOSE_UPS[-1]),
            s.samples,
            s.coverage,
            s.mean_width,
            s.crps,
            s.interval_score,
        )
        for kind, bands in results.time.items()
        for test, band in enumerate(bands)
        for s in band.scores
    ]
    return StudyTable(keys, rows)


def simulated_coverage(results: Results) -> StudyTable:
    """Return the coverage of both bands on each simulated test."""
    rows = [(c.glue, c.total, c.phi, c.noise) for c in results.covered]
    return StudyTable(('GLUE band [1]', 'total band [1]', 'phi', 'noise [m]'), rows)
