"""R-hat and effective sample size agree with arviz."""

from __future__ import annotations

import arviz as az
import numpy as np
import pytest

from actuator_glue.inference.convergence import ess_bulk, rhat
from actuator_glue.records import Array


def _chains(rng: np.random.Generator, steps: int, chains: int, phi: Array) -> Array:
    """AR(1) chains, one parameter per coefficient."""
    noise = rng.standard_normal((steps, chains, len(phi)))
    draws = np.empty_like(noise)
    draws[0] = noise[0]
    for t in range(1, steps):
        draws[t] = phi * draws[t - 1] + np.sqrt(1.0 - phi**2) * noise[t]
    return draws


PHI = np.array([0.0, 0.5, 0.95, -0.5, 0.99])


@pytest.mark.parametrize(('steps', 'chains'), [(1000, 4), (333, 20), (51, 3), (10, 2)])
def test_rhat_and_bulk_ess_are_those_of_arviz(rng_seed: int, steps: int, chains: int) -> None:
    rng = np.random.default_rng(rng_seed)
    draws = _chains(rng, steps, chains, PHI)
    draws[:, 0, 1] += 0.4  # one chain elsewhere
    draws[..., 2] = np.exp(draws[..., 2])  # heavy tail
    draws[:, :, 3] = np.round(draws[:, :, 3], 1)  # ties
    data = az.convert_to_dataset({'x': np.swapaxes(draws, 0, 1)})
    assert np.allclose(rhat(draws), az.rhat(data, method='rank')['x'], rtol=1e-9)
    assert np.allclose(ess_bulk(draws), az.ess(data, method='bulk')['x'], rtol=1e-6)


def test_stuck_chains_and_short_ones(rng_seed: int) -> None:
    rng = np.random.default_rng(rng_seed)
    apart = _chains(rng, 400, 4, PHI) + np.arange(4)[:, None] * 5.0
    assert (rhat(apart) > 1.5).all()
    assert np.isnan(rhat(apart[:3])).all()
    assert np.isnan(ess_bulk(apart[:3])).all()
    still = np.ones((100, 4, 1))
    assert np.isnan(ess_bulk(still)).all()
    assert np.isnan(rhat(still)).all()
