"""Sampling coordinates of windows with effects: one-to-one, prior uniform, ridges straight."""

import numpy as np
import pytest

from actuator_glue.model.effects import CATALOGUE
from actuator_glue.online.coordinates import Coordinates
from actuator_glue.online.fitting import choose_model
from actuator_glue.online.shear import Shear

PAIRS = (('gain', 'viscous-damping', 'payload-inertia', 'stribeck-friction', 'delay'),)


def inside(model, count, seed):
    """Points of the prior that ordinary machines have."""
    low, high = model.bounds
    share = np.random.default_rng(seed).uniform(0.05, 0.6, (count, len(low)))
    return low + share * (high - low)


def determinant(there, phi):
    """Log |d theta / d phi| by central differences."""
    step = 1e-6 * np.maximum(np.abs(phi), 1e-3 * np.minimum(there.upper - there.lower, 1.0))
    columns = [
        (there.physical(phi + h) - there.physical(phi - h)) / (2 * step[j])
        for j, h in enumerate(np.diag(step))
    ]
    scale = np.abs(there.physical(phi)) + 1e-12
    return np.linalg.slogdet(np.array(columns) / scale)[1] + np.log(scale).sum()


@pytest.mark.parametrize('stiffness', [0.0, 250e3])
@pytest.mark.parametrize('effects', [*((name,) for name in CATALOGUE), *PAIRS])
@pytest.mark.parametrize('sheared', [False, True])
def test_coordinates_are_one_to_one_and_the_prior_stays_uniform(effects, stiffness, sheared):
    model = choose_model(effects)
    points = inside(model, 400, seed=1) if sheared else None
    there = Coordinates(model, stiffness, points, middle=25.0)
    theta = inside(model, 12, seed=2)
    phi = there.coordinates(theta)
    got = there.log_jacobian(phi)
    kept = np.isfinite(got) & (phi > there.lower).all(axis=1) & (phi < there.upper).all(axis=1)
    assert kept.sum() >= 3
    assert np.allclose(there.physical(phi)[kept], theta[kept], rtol=1e-6, atol=1e-12)
    expected = np.array([determinant(there, at) for at in phi[kept]])
    difference = got[kept] - expected
    assert np.ptp(difference) < 1e-3


def test_a_shear_straightens_a_bent_ridge_and_keeps_volumes():
    rng = np.random.default_rng(3)
    wide, thin = rng.standard_normal((2, 2000))
    bent = np.stack([wide, 0.3 * wide**2 + 0.02 * thin], axis=1)
    shear = Shear(bent)
    straight = shear.straight(bent)
    assert np.allclose(shear.bent(straight), bent, atol=1e-9)
    for known in (straight[:, 0], straight[:, 0] ** 2):
        assert abs(np.corrcoef(known, straight[:, 1])[0, 1]) < 0.1
    # In the plane the bend is fifteen times as wide as the ridge.
    near = np.abs(straight[:, 0]) < 2.0
    assert straight[near, 1].std() == pytest.approx(1.0, abs=0.2)
