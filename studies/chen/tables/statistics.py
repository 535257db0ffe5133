"""Tables of posteriors: priors, shaping factors, Table 4, shapes of residual."""

from __future__ import annotations

from studies.chen.library import BASE, NAMES, TABLE_2
from studies.chen.published import CHANGE, TABLE_3, TABLE_4
from studies.chen.study import Results
from studies.chen.table import StudyTable
from studies.chen.words import KINDS, SYMBOLS, named_parameters, shaping_factor


def priors(results: Results) -> StudyTable:
    """Return Table 3 beside the bounds used."""
    rows = [
        (name, *published, p.lower, p.upper)
        for name, published, p in zip(named_parameters(), TABLE_3, BASE, strict=True)
    ]
    return StudyTable(('parameter', 'lower', 'upper', 'lower, used', 'upper, used'), rows)


def shaping_factors(results: Results, kind: str) -> StudyTable:
    """Return what each shaping factor leads to with one kind of residual."""
    keys = (
        'G',
        'R-hat < 1.2 after, from the prior',
        'ours',
        'R-hat, ours',
        *(f'COV {s}' for s in SYMBOLS),
        'widest of the prior [1]',
        'held-out inside [1]',
        'width [m]',
        'converged',
        'informative',
    )
    rows = [
        (
            shaping_factor(s.shaping_factor),
            s.published_trace.converged_at(),
            s.ours_trace.converged_at(),
            s.ours.chains.rhat.max(),
            *s.ours.moments.cov,
            s.ours.prior_share().max(),
            s.held_out,
            s.width,
            s.converged,
            s.informative,
        )
        for s in results.shaped[kind]
    ]
    return StudyTable(keys, rows)


def choices(results: Results) -> StudyTable:
    """Return the shaping factors chosen automatically."""
    rows = [
        (KINDS[kind], shaping_factor(c.shaping_factor), c.held_out, c.usable, c.covers)
        for kind, c in results.choices.items()
    ]
    return StudyTable(('residual', 'chosen', 'held-out inside [1]', 'candidates', 'covers'), rows)


def table_4(results: Results) -> StudyTable:
    """Return Table 4 of the paper and of both posteriors."""
    keys = (
        'parameter',
        'posterior',
        'mean',
        'standard deviation',
        'skewness',
        'COV',
        'off in COV [1]',
        'off Table 2 in the mean [1]',
    )
    rows = []
    for i, name in enumerate(named_parameters()):
        published = [TABLE_4[m][i] for m in ('mean', 'stddev', 'skewness', 'cov')]
        rows.append((name, 'paper', *published, None, CHANGE[i]))
        for kind, p in results.posteriors.items():
            m = p.moments
            off = m.cov[i] / TABLE_4['cov'][i] - 1.0, m.mean[i] / TABLE_2[i] - 1.0
            rows.append((name, KINDS[kind], m.mean[i], m.stddev[i], m.skewness[i], m.cov[i], *off))
    return StudyTable(keys, rows)


def shapes(results: Results) -> StudyTable:
    """Return posteriors with residuals of several shapes against Table 4."""
    keys = [f'off in {m} {s} [1]' for m in ('mean', 'COV') for s in SYMBOLS]
    matched = results.table_4.matched
    named = {f'white noise, {1e3 * matched.best_rms:.2f} mm rms': matched} | results.shapes
    rows = [
        (
            name,
            p.best_rms,
            *(p.moments.mean / TABLE_4['mean'] - 1.0),
            *(p.moments.cov / TABLE_4['cov'] - 1.0),
        )
        for name, p in named.items()
    ]
    return StudyTable(('residual', 'rms at best fit [m]', *keys), rows)


def matches(results: Results) -> StudyTable:
    """Return the residual at which each moment of the first three is nearest to Table 4."""
    found = results.table_4
    rows = [
        ('COV', found.matched.best_rms),
        ('mean', found.mean_rms),
        ('skewness', found.skewness_rms),
    ]
    return StudyTable(('moment', 'residual rms [m]'), rows)


def posteriors(results: Results) -> StudyTable:
    """Return moments and convergence of every posterior sampled."""
    runs = {f'G_6, {KINDS[kind]}': p for kind, p in results.posteriors.items()}
    runs |= {'equivalent shaping factor': results.table_4.literal} | results.shapes
    for kind, entries in results.shaped.items():
        runs |= {f'G = {s.shaping_factor:g}, {KINDS[kind]}': s.ours for s in entries}
    keys = (
        'posterior',
        'parameter',
        'shaping factor',
        'residual rms [m]',
        'added rms [m]',
        'evaluations',
        'R-hat',
        'ESS',
        'mean',
        'standard deviation',
        'skewness',
        'COV',
        'standard deviation over prior',
    )
    rows = []
    for name, p in runs.items():
        m, chains = p.moments, p.chains
        columns = (chains.rhat, chains.ess, m.mean, m.stddev, m.skewness, m.cov, p.prior_share())
        rows += [
            (name, parameter, p.shaping_factor, p.best_rms, p.added_rms, chains.evaluations, *of)
            for parameter, *of in zip(NAMES, *columns, strict=True)
        ]
    return StudyTable(keys, rows)
