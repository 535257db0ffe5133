"""A posterior pressed against a bound is told from one that ends before it."""

import numpy as np
import pytest

from actuator_glue.inference.at_bound import pressed


def truncated(rng: np.random.Generator, mean: float) -> np.ndarray:
    """Draws of a normal posterior of unit standard deviation, cut at 400."""
    draws = rng.normal(mean, 1.0, 400_000)
    return draws[draws <= 400.0][:4000, None]


@pytest.mark.parametrize('mean', [399.5, 400.0, 401.0, 402.0])
def test_a_posterior_cut_by_its_bound_is_pressed(mean: float, rng_seed: int) -> None:
    """With 4000 draws the share at the bound is 1.5 times what is told at least."""
    (found,) = pressed(truncated(np.random.default_rng(rng_seed), mean), ('beta_1',), [0], [400])
    assert (found.name, found.side, found.bound, found.physical) == ('beta_1', 'upper', 400, False)
    assert found.share > found.flat_share / 2


@pytest.mark.parametrize('mean', [397.0, 396.0, 200.0])
def test_a_posterior_beside_its_bound_is_not(mean: float, rng_seed: int) -> None:
    """Three standard deviations are enough, however wide the prior."""
    draws = truncated(np.random.default_rng(rng_seed), mean)
    assert pressed(draws, ('beta_1',), [0], [400]) == ()


def test_what_the_data_leave_open_is_not_pressed(rng_seed: int) -> None:
    """A posterior as wide as its prior reaches both bounds by nature."""
    draws = np.random.default_rng(rng_seed).uniform(0.0, 1.0, (4000, 1))
    assert pressed(draws, ('alpha_3',), [0], [1]) == ()


def test_zero_is_a_physical_bound(rng_seed: int) -> None:
    """A leakage of nearly nothing piles up at zero; a bound that was chosen is no such thing."""
    rng = np.random.default_rng(rng_seed)
    draws = np.array([0.0, 1.0]) + rng.exponential(0.01, (4000, 2))
    found = pressed(draws, ('alpha_3', 'beta_1'), [0.0, 1.0], [100.0, 400.0])
    assert [(f.name, f.side, f.physical) for f in found] == [
        ('alpha_3', 'lower', True),
        ('beta_1', 'lower', False),
    ]
