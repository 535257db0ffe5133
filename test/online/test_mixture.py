"""Quantiles of mixtures against distribution functions summed one by one."""

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from scipy.special import ndtr, ndtri

from actuator_glue.online import mixture, series
from actuator_glue.online.mixture import mixture_band

LEVELS = np.array([0.5, 0.95])
PROBABILITY = np.concatenate([(1 - LEVELS) / 2, [0.5], (1 + LEVELS) / 2])


def exact(x, sd, probability):
    """Quantiles of normal components x (m,), sd (m,), by bisection to rounding."""
    low = np.full(len(probability), (x - 12 * sd).min())
    high = np.full(len(probability), (x + 12 * sd).max())
    for _ in range(90):
        middle = 0.5 * (low + high)
        below = ndtr((middle[:, None] - x) / sd).mean(axis=1) < probability
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    return 0.5 * (low + high)


def smooth(rng, m, n, share, shape):
    """Responses (n, m) of a few random sines, the spread of the draws around them."""
    t = np.arange(n)[:, None]
    factor = {
        'normal': lambda: rng.standard_normal((2, m)),
        'skewed': lambda: rng.exponential(size=(2, m)) - 1.0,
        'two hills': lambda: np.where(rng.random((2, m)) < 0.3, -1.5, 1.0),
    }[shape]()
    return share * (factor[0] * np.sin(0.05 * t) + factor[1] * np.cos(0.031 * t)) + np.sin(
        0.02 * t
    )


# 15 of 20 components below a gap a thousand times as wide as they are: level at 0.75.
@example(seed=286, share=1000.0, shape='two hills', freedom=30.0, scale=1e-9, m=20)
@given(
    seed=st.integers(0, 2**32),
    share=st.sampled_from([1e-3, 0.05, 0.3, 1.0, 3.0, 30.0, 1000.0]),
    shape=st.sampled_from(['normal', 'skewed', 'two hills']),
    freedom=st.sampled_from([3.0, 30.0, 1000.0, np.inf]),
    scale=st.sampled_from([1e-9, 1e-5, 1.0]),
    m=st.sampled_from([2, 20, 200]),
)
def test_quantiles_are_exact_to_a_ten_thousandth(seed, share, shape, freedom, scale, m):
    rng = np.random.default_rng(seed)
    columns = scale * smooth(rng, m, 40, share, shape)
    mean = scale * 0.05 * rng.standard_normal(m)
    sd = scale * np.ones(m)
    if np.isfinite(freedom):
        sd *= np.sqrt(freedom / rng.chisquare(freedom, m))
    band = mixture_band(columns.T, mean, sd, LEVELS)
    found = np.vstack([band.lower, band.median, band.upper]).T
    for j in range(0, 40, 6):
        truth = exact(columns[j] + mean, sd, PROBABILITY)
        width = np.sqrt(columns[j].var() + (sd**2).mean())
        # Quantiles between separate hills move freely; distribution functions do not.
        at = ndtr((found[j][:, None] - columns[j] - mean) / sd).mean(axis=1)
        off = np.minimum(np.abs(found[j] - truth) / width, np.abs(at - PROBABILITY))
        assert off.max() < 1e-4


def test_usual_windows_are_done_by_the_series_and_its_bound_holds():
    rng = np.random.default_rng(0)
    for share in (0.01, 0.1, 0.2):
        columns = smooth(rng, 200, 50, share, 'normal')
        mean, sd = 0.02 * rng.standard_normal(200), np.sqrt(1000 / rng.chisquare(1000, 200))
        out = np.empty((5, 50))
        done = mixture._quantiles(columns, mean, sd, PROBABILITY, ndtri(PROBABILITY), out)
        assert done == 50
        for j in range(50):
            truth = exact(columns[j] + mean, sd, PROBABILITY)
            assert np.abs(out[:, j] - truth).max() < 2e-5


@pytest.mark.parametrize(('offset', 'excess'), [(0.3, 0.1), (0.6, 0.3), (0.1, 0.4)])
def test_the_bound_of_the_terms_left_out_is_one(offset, excess):
    """Worst components: as far off and as wide as the bound is told, in one direction."""
    wanted = 1e-5
    terms = series.terms_needed(offset, excess, wanted)
    assert terms > 0
    a = np.zeros(series.SIZE)
    variance, spare = np.array([1.0 - excess]), np.empty((2, 1))
    series.coefficients(np.array([offset]), variance, 1.0, terms, spare, a)
    a[0], a[1], a[2] = 1.0, offset, 0.5 * (offset**2 - excess)
    u = np.linspace(-4, 4, 81)
    he = np.empty((len(u), series.MOST + 2))
    for row, at in zip(he, u, strict=True):
        series.hermite(at, row)
    phi = np.exp(-0.5 * u**2) / np.sqrt(2 * np.pi)
    found = ndtr(u) - phi * (he[:, :terms] @ a[1 : terms + 1])
    truth = ndtr((u - offset) / np.sqrt(1 - excess))
    bound = wanted * mixture._CRAMER / np.sqrt(2 * np.pi) * np.exp(-0.25 * u**2)
    assert (np.abs(found - truth) <= bound + 1e-15).all()
    assert np.abs(found - truth).max() > 1e-12  # something was left out


def test_components_beyond_all_bounds_are_summed():
    assert series.terms_needed(0.1, 1.0, 1e-5) == 0
    assert series.terms_needed(5.0, 0.1, 1e-5) == 0
