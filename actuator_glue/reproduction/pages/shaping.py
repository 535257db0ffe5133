"""Rows 4 and 5: GLUE with eight shaping factors, chains and convergence."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from actuator_glue.model.parameters import BASE
from actuator_glue.report.html import Note, Picture, Section, Table, Text
from actuator_glue.reproduction.figures import shaping as figures
from actuator_glue.reproduction.pages.format import SYMBOLS, UNITS, num, percent, power_of_two
from actuator_glue.reproduction.published import CHOSEN, SHAPING_FACTORS
from actuator_glue.reproduction.shaping import STRICT, WIDEST, Shaped
from actuator_glue.reproduction.study import Results

KINDS = {'sensor': 'sensor noise', 'matched': 'matched residual'}


def shaping(results: Results) -> Section:
    """Return the section on the shaping factor (Table 3, Figs. 5 and 6)."""
    size = num(1e3 * results.table_4.matched.best_rms, 2)
    matched = figures.shown(results.shaped['matched'])
    broad = matched['G_8'].ours.prior_share()
    shares = ', '.join(num(float(s), 2) for s in broad)
    return Section(
        'Shaping factor, chains, convergence (rows 4, 5; Table 3, Figs. 5, 6)',
        [
            Text(
                'L = −G ln Var[E(θ)], Eq. (4), uniform priors within Table 3, sampled by '
                'DREAM(ZS). Every G is sampled twice: as the paper cites it (Vrugt 2016: three '
                'chains from '
                'the prior) and as this project does (annealed start, more chains; '
                'docs/dream.md). And on two sets of data: with sensor noise only, and with the '
                'residual of '
                f'{size} mm at which our spread matches Table 4 (next section), because the '
                'paper\'s figures can only be compared at the paper\'s spread.'
            ),
            Table(
                ('parameter', 'lower', 'upper'),
                [
                    (f'{s} [{u}]', num(p.lower, 2), num(p.upper, 2))
                    for s, u, p in zip(SYMBOLS, UNITS, BASE, strict=True)
                ],
                'Table 3: bounds of the uniform priors, as published and as used.',
            ),
            Picture.of(
                figures.chains(results.shaped['matched']),
                'Fig. 5 of the paper: chains within the bounds of Table 3, matched residual, '
                'three chains from the prior. As published, G₁ settles on the deterministic '
                'values and G₈ wanders between the bounds.',
            ),
            Picture.of(
                figures.convergence(results.shaped['matched']),
                'Fig. 6 of the paper: Gelman-Rubin R-hat over the last half of the chains, '
                'matched residual. Bottom: the same posteriors from the annealed start, whose '
                'evaluations are counted.',
            ),
            Note(_wandering(matched['G_8'], shares)),
            Note(_order(matched)),
            *(_study(results, kind) for kind in KINDS),
            Picture.of(
                figures.spread_against_g(results.shaped, KINDS),
                'Posterior spread and held-out coverage of the GLUE band against G. Calibrated '
                'on alternate blocks of 6 s, counted on the others.',
            ),
            *(_choice(results, kind) for kind in KINDS),
        ],
    )  # fmt: skip


def _wandering(entry: Shaped, shares: str) -> str:
    at = entry.published_trace.converged_at()
    converges = (
        f'its R-hat stays below 1.2 after {num(at, 3)} evaluations, like the others'
        if np.isfinite(at)
        else f'from the annealed start its R-hat stays below 1.2 after '
        f'{num(entry.ours_trace.converged_at(), 3)} evaluations'
    )
    return (
        f'The wandering of G₈ is not missing convergence, as the paper reads it: {converges}. The '
        f'posterior itself fills the priors: its standard deviations are {shares} of the '
        "prior's for the four parameters. More evaluations cannot narrow it."
    )


def _order(entries: Mapping[str, Shaped]) -> str:
    large, small = (entries[g].published_trace.converged_at() for g in ('G_1', 'G_8'))
    found = f'G₁ takes {num(large, 3)} evaluations and G₈ {num(small, 3)}'
    claim = 'The paper finds that convergence takes longer for small G. '
    if not max(large, small) > 2.0 * min(large, small):
        return (
            f'{claim}Here, from the prior, {found}: no order, since single runs scatter by a '
            'factor of two.'
        )
    if large > small:
        return (
            f'{claim}Here it is the other way round: from the prior {found}. A narrow posterior '
            'is harder to find; once found, both are sampled alike.'
        )
    return f'{claim}So it does here: from the prior {found}.'


def _study(results: Results, kind: str) -> Table:
    rows = []
    for s in results.shaped[kind]:
        moments = s.ours.moments
        rows.append(
            (
                f'{power_of_two(s.shaping_factor)}\xa0(G{_index(s.shaping_factor)})',
                num(s.published_trace.converged_at(), 3),
                num(s.ours_trace.converged_at(), 3),
                num(float(s.ours.chains.rhat.max()), 4),
                *(num(float(c), 2) for c in moments.cov),
                percent(float(s.ours.prior_share().max()), 0),
                percent(s.held_out),
                num(1e6 * s.width, 3),
            )
        )
    return Table(
        (
            'G', 'R-hat < 1.2 after, from the prior', 'ours', 'R-hat, ours',
            *(f'COV {s}' for s in SYMBOLS), 'widest of the prior', 'held-out inside',
            'width [µm]',
        ),
        rows,
        f'Shaping factors with {KINDS[kind]}. Evaluations until every R-hat stays below 1.2; '
        'R-hat of the whole run is rank-normalised (stricter); spread; coverage and mean width of '
        'the 95 % GLUE band on held-out blocks.',
    )  # fmt: skip


def _index(factor: float) -> str:
    place = SHAPING_FACTORS.index(factor) + 1
    return '₀₁₂₃₄₅₆₇₈'[place]


def _choice(results: Results, kind: str) -> Note:
    choice = results.choices[kind]
    same = choice.shaping_factor == CHOSEN
    beside = "the paper's hand-made choice too" if same else 'the paper chose G₆ = 2⁸ by hand'
    return Note(
        f'Automatic choice with {KINDS[kind]}: G = {power_of_two(choice.shaping_factor)} '
        f'(G{_index(choice.shaping_factor)}); {beside}. Reason: {choice.reason}. Candidates must '
        f'reach a rank-normalised R-hat below {STRICT} and narrow every parameter to less than '
        f'{percent(WIDEST, 0)} of its prior.'
    )  # fmt: skip
