"""What the numbers say: every judgement in the report is computed here, none is typed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from studies.chen.identify import implied
from studies.chen.laboratory import Posterior
from studies.chen.library import BASE, EQUATION_3, STIFFNESS, TABLE_2, Array, linear
from studies.chen.misfit import removed
from studies.chen.published import CLOSE_UPS, TABLE_3, TABLE_4
from studies.chen.responses import CLOSE, GRID, LEVEL
from studies.chen.study import NOISE_FREE, Results
from studies.chen.words import SYMBOLS, listed, num

MET = 0.01  # a coefficient this near counts as met
AGREE = 0.15  # COVs this near to Table 4 agree
IMITATED = 0.25  # a residual whose means lie this near to Table 4 could be the paper's
SCATTER = 2.0  # two runs' convergence scatters by this factor
ALIKE = 1.25  # residuals within this factor point to one size
TOLERANCE = 0.02  # coverage this far from its level covers too little or too much


def bounds_as_published() -> bool:
    """Tell whether our priors have Table 3's bounds."""
    return bool(np.array_equal([(p.lower, p.upper) for p in BASE], TABLE_3))


def model_difference() -> float:
    """Return the largest relative difference of Eq. (2a) from Eq. (1), solved at `GRID`.

    Valve, oil and specimen as they stand there, three unknowns at each frequency: alpha_1 q, f and
    x under u = 1.
    """
    beta_1, product, alpha_2, alpha_3 = TABLE_2
    largest = 0.0
    for stiffness in STIFFNESS:
        response = linear.frequency_response(TABLE_2, stiffness, GRID)
        for frequency, found in zip(GRID, response, strict=True):
            s = 2j * np.pi * frequency
            equations = np.array(
                [
                    [s + beta_1, 0.0, product],
                    [-1.0, s + alpha_3, alpha_2 * s],
                    [0.0, 1.0, -stiffness],
                ]
            )
            x = np.linalg.solve(equations, np.array([product, 0.0, 0.0]))[2]
            largest = max(largest, float(abs(found / x - 1.0)))
    return largest


def spring_more(results: Results, what: str) -> list[float]:
    """Return at which close-ups [Hz] the spring test has more 'decay' or 'delay' than the free."""
    free, spring = results.readings
    return [
        a.frequency_hz
        for a, b in zip(free, spring, strict=True)
        if getattr(b, what) > getattr(a, what)
    ]


def largest_miss(results: Results) -> float:
    """Return the largest relative difference of the noise-free fits from Eqs. (3a), (3b)."""
    fits = np.array([f.value for f in results.identified[NOISE_FREE]])
    return float(np.abs(fits / EQUATION_3 - 1.0).max())


def coefficients_met(theta: Array = TABLE_2) -> int:
    """Return how many of the six identified coefficients theta (4,) gives within 1 %."""
    return int(np.count_nonzero(np.abs(implied(theta) / EQUATION_3 - 1.0) <= MET))


def order_of_convergence(results: Results) -> str:
    """Return whether small G converges later from the prior: 'later', 'earlier' or 'alike'."""
    large, small = (
        results.shown('matched')[g].published_trace.converged_at() for g in ('G_1', 'G_8')
    )
    if not max(large, small) > SCATTER * min(large, small):
        return 'alike'
    return 'later' if small > large else 'earlier'


def agreeing(results: Results, limit: float = AGREE) -> list[str]:
    """Return which of beta_1, alpha_1 beta_0, alpha_2 have Table 4's COV at the match."""
    off = results.table_4.off('cov')
    return [s for s, d in zip(SYMBOLS[:3], off, strict=False) if abs(d) <= limit]


def one_size(results: Results) -> bool:
    """Tell whether means, skewnesses and COVs point to about the same residual."""
    found = results.table_4
    sizes = (found.mean_rms, found.skewness_rms, found.matched.best_rms)
    return max(sizes) <= ALIKE * min(sizes)


def like_table_4(results: Results, like: bool) -> list[str]:
    """Return the shapes of residual whose first means and COVs are, or are not, near Table 4."""

    def near(p: Posterior) -> bool:
        off = [p.moments.mean / TABLE_4['mean'] - 1.0, p.moments.cov / TABLE_4['cov'] - 1.0]
        return bool((np.abs(np.array(off)[:, :3]) <= IMITATED).all())

    return [name for name, p in results.shapes.items() if near(p) == like]


def correlations(posterior: Posterior) -> Array:
    """Return the correlations of a posterior's parameters, shape (4, 4)."""
    return np.asarray(np.corrcoef(posterior.chains.posterior(), rowvar=False))


def outside(results: Results, kind: str, test: int, quantity: str) -> str:
    """Return the frequencies at which the experiment lies outside a 95 % band, for people."""
    inside: NDArray[np.bool_] = results.frequency[kind][test][quantity].inside
    if inside.all():
        return 'nowhere'
    edges = np.flatnonzero(np.diff(np.concatenate([[True], inside, [True]]).astype(int)))
    spans = [(GRID[a], GRID[b - 1]) for a, b in zip(edges[::2], edges[1::2], strict=True)]
    return listed(f'{a:.1f}–{b:.1f} Hz' if b > a else f'{a:.1f} Hz' for a, b in spans)


def overlap(
    results: Results, test: int, quantity: str, at: int, published: Sequence[float]
) -> float:
    """Return what our 95 % range at a close-up and a published range share, over their union."""
    draws = results.frequency['matched'][test][quantity].draws[:, CLOSE[at]]
    lower, upper = np.quantile(draws, [0.5 - LEVEL / 2, 0.5 + LEVEL / 2])
    common = min(upper, published[1]) - max(lower, published[0])
    return float(max(common, 0.0) / (max(upper, published[1]) - min(lower, published[0])))


def fewest_inside(results: Results, kind: str) -> list[float]:
    """Return the close-up [Hz] of each test at which a band covers fewest samples."""
    return [CLOSE_UPS[int(np.argmin(band.near))] for band in results.time[kind]]


def miscovered(results: Results, test: int, sign: int) -> str:
    """Return the ranges [Hz] in which the total band covers too little (-1) or too much (1)."""
    found = [
        f'{s.low_hz:g}–{min(s.high_hz, CLOSE_UPS[-1]):.0f} Hz'
        for s in results.time['total'][test].scores[1:]
        if sign * (s.coverage - LEVEL) > TOLERANCE
    ]
    return listed(found) if found else 'no range'


def gain_removes(results: Results, name: str) -> float:
    """Return the share of the spring test's held-out residual above noise that a refit removes."""
    return removed(results.refits['both'].held_out[1], results.refits[name].held_out[1])


def coverage_range(results: Results, what: str) -> tuple[float, float, float]:
    """Return mean, least and largest simulated coverage of the 'total' or 'glue' band."""
    shares = [getattr(c, what) for c in results.covered]
    return float(np.mean(shares)), min(shares), max(shares)


def reached(evaluations: float) -> str:
    """Return after how many evaluations a run converged, for people."""
    return f'after {num(evaluations, 3)} evaluations' if np.isfinite(evaluations) else 'not at all'
