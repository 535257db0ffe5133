"""Tables of what was identified, fitted and refitted without any posterior."""

from __future__ import annotations

import numpy as np

from studies.chen.experiment import stiffness_name
from studies.chen.identify import implied
from studies.chen.library import EQUATION_3, NAMES, TABLE_2
from studies.chen.study import NOISY, Results
from studies.chen.table import StudyTable
from studies.chen.words import named_parameters

TESTS = (0, 1)


def readings(results: Results) -> StudyTable:
    """Return amplitude and phase read off the sweeps."""
    keys = (
        'test',
        'f [Hz]',
        'amplitude ratio',
        'expected',
        'decay [1]',
        'phase [rad]',
        'expected phase [rad]',
        'delay [s]',
    )
    rows = [
        (
            stiffness_name(test),
            r.frequency_hz,
            r.amplitude,
            abs(r.expected),
            r.decay,
            r.phase,
            float(np.angle(r.expected)),
            r.delay,
        )
        for test in TESTS
        for r in results.readings[test]
    ]
    return StudyTable(keys, rows)


def transfer_functions(results: Results) -> StudyTable:
    """Return Eqs. (3a) and (3b) beside what was fitted, without and with noise."""
    keys = (
        'test',
        'coefficient',
        'published',
        'ours',
        'off [1]',
        '95 % from',
        'to',
        'inside',
    )
    rows = []
    for test in TESTS:
        for kind, fits in results.identified.items():
            fit = fits[test]
            published = np.append(EQUATION_3[test], EQUATION_3[test, 2] / EQUATION_3[test, 1])
            ours = np.append(fit.value, fit.static_gain)
            reach = fit.reach() * np.append(fit.stddev, fit.static_gain_stddev)
            low, high = ours - reach, ours + reach
            inside = (low <= published) & (published <= high)
            for i, name in enumerate(('a₁', 'a₀', 'b₀', 'b₀/a₀')):
                limits = (low[i], high[i], inside[i]) if kind == NOISY else (None, None, None)
                values = (published[i], ours[i], ours[i] / published[i] - 1.0, *limits)
                rows.append((f'{stiffness_name(test)}, {kind}', name, *values))
    return StudyTable(keys, rows)


def joint_fit(results: Results) -> StudyTable:
    """Return Table 2 beside the joint fit of Eq. (2)."""
    fit = results.physical
    keys = ('parameter', 'Table 2', 'joint fit', 'standard error', 'at its bound', 'off [1]')
    columns = (TABLE_2, fit.theta, fit.stddev, fit.at_bound, fit.theta / TABLE_2 - 1.0)
    return StudyTable(keys, list(zip(named_parameters(), *columns, strict=True)))


def coefficients(results: Results) -> StudyTable:
    """Return the identified coefficients of Eq. (2b) beside what parameters give for them."""
    keys = (
        'coefficient',
        'identified',
        'from Table 2',
        'off with Table 2 [1]',
        'from the joint fit',
        'off with the joint fit [1]',
    )
    names = [f'{c} at {stiffness_name(t)}' for t in TESTS for c in ('d₁/d₂', 'd₀/d₂', 'n₀/d₂')]
    table_2, fitted = implied(TABLE_2), implied(results.physical.theta)
    off = table_2 / EQUATION_3 - 1.0, fitted / EQUATION_3 - 1.0
    columns = (EQUATION_3, table_2, off[0], fitted, off[1])
    return StudyTable(keys, list(zip(names, *(c.ravel() for c in columns), strict=True)))


def rms(results: Results) -> StudyTable:
    """Return the simulation errors of Table 2 and of the fits."""
    rows = [('Table 2', *results.physical.table_2_rms), ('joint fit', *results.physical.rms)]
    rows += [
        (f'Eqs. (3a), (3b) fitted, {kind}', *(f.rms for f in fits))
        for kind, fits in results.identified.items()
    ]
    return StudyTable(('model', *(f'{stiffness_name(t)} [m]' for t in TESTS)), rows)


def refits(results: Results) -> StudyTable:
    """Return structures refitted with and without a static gain."""
    keys = (
        'structure',
        'gain',
        'fitted, k = 0 [m]',
        'fitted, spring [m]',
        'held out, k = 0 [m]',
        'held out, spring [m]',
        *NAMES,
    )
    rows = [
        (
            r.name,
            r.gain,
            *(by.get(t) for by in (r.fitted, r.held_out) for t in TESTS),
            *r.theta[:4],
        )
        for r in results.refits.values()
    ]
    return StudyTable(keys, rows)


def diagnoses(results: Results) -> StudyTable:
    """Return what the diagnosis says of the records."""
    rows = []
    for name, d in results.diagnoses.items():
        found = [
            f'{e.name} {p.mean:.5g} ({p.lower:.5g} to {p.upper:.5g})'
            for e in d.effects
            for p in e.parameters.values()
        ]
        error = d.error
        rows.append(
            (
                name,
                d.verdict,
                ', '.join(found) or '–',
                error.before,
                error.after,
                error.noise_floor,
            )
        )
    keys = ('records', 'verdict', 'effects (95 %)', 'before [m]', 'after [m]', 'noise [m]')
    return StudyTable(keys, rows)
