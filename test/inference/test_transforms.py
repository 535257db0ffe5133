"""Every transform: one-to-one, inside its bounds, with the Jacobian that it says."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pytest

from actuator_glue.inference.choice import ModelChoice, choose_model
from actuator_glue.inference.transforms import Composed, Transform
from actuator_glue.inference.transforms.inverse_response import Ridge
from actuator_glue.inference.transforms.laplace import Laplace
from actuator_glue.inference.transforms.log import Log
from actuator_glue.inference.transforms.near_zero import NearZero
from actuator_glue.inference.transforms.triangular import Triangular
from actuator_glue.model.effects import CATALOGUE
from actuator_glue.records import Array

MANY = ('gain', 'viscous-damping', 'payload-inertia', 'stribeck-friction', 'delay')


class Case(NamedTuple):
    """A transform and points (m, p) that it should take there and back."""

    transform: Transform
    points: Array


def _points(model: ModelChoice, count: int, seed: int) -> Array:
    """Points of the prior that ordinary machines have."""
    low, high = model.bounds
    share = np.random.default_rng(seed).uniform(0.05, 0.6, (count, len(low)))
    return low + share * (high - low)


def _ridge(effects: tuple[str, ...], stiffness: float) -> tuple[Ridge, ModelChoice]:
    model = choose_model(effects)
    return Ridge(model.names, *model.bounds, stiffness, middle=25.0), model


def _straight(effects: tuple[str, ...], stiffness: float) -> Case:
    ridge, model = _ridge(effects, stiffness)
    return Case(ridge, _points(model, 12, 2))


def _bent(effects: tuple[str, ...], stiffness: float) -> Case:
    ridge, model = _ridge(effects, stiffness)
    earlier = Triangular(ridge.forward(_points(model, 400, 1)))
    return Case(Composed(ridge, earlier), _points(model, 12, 2))


def _log() -> Case:
    low, high = np.array([0.0, -3.0, 0.0, 2.0]), np.array([1e9, 4.0, 1e-3, 2.5])
    share = np.random.default_rng(0).uniform(0.01, 0.99, (20, 4))
    return Case(Log(low, high), low + share * (high - low))


def _laplace() -> Case:
    rng = np.random.default_rng(1)
    spread = rng.standard_normal((4, 4))
    covariance = spread @ spread.T * np.outer(*2 * [[1.0, 1e6, 1e-3, 1.0]])
    centre = np.array([3.0, 1e7, 0.0, -1.0])
    points = rng.multivariate_normal(centre, covariance, 20)
    return Case(Laplace(centre, covariance, np.full(4, 1e9)), points)


def _near_zero() -> Case:
    rng = np.random.default_rng(4)
    points = rng.standard_normal((20, 3))
    points[:, 1] = 10.0 ** rng.uniform(-8.0, 2.0, 20)
    return Case(NearZero(1, 0.05, 3), points)


def _triangular() -> Case:
    rng = np.random.default_rng(3)
    wide, thin, free, own = rng.standard_normal((4, 500))
    points = np.stack([wide, 0.3 * wide**2 + 0.02 * thin, 1e3 * free, own + wide], axis=1)
    return Case(Triangular(points), points[:20])


CASES: dict[str, Callable[[], Case]] = {
    'log': _log,
    'laplace': _laplace,
    'near zero': _near_zero,
    'triangular': _triangular,
}
for _k in (0.0, 250e3):
    for _effects in ((), *((name,) for name in CATALOGUE), MANY):
        _name = f'{"+".join(_effects) or "linear"}, k={_k:g}'
        CASES[f'ridge, {_name}'] = lambda effects=_effects, k=_k: _straight(effects, k)
        CASES[f'ridge and triangular, {_name}'] = lambda effects=_effects, k=_k: _bent(effects, k)


def _determinant(there: Transform, z: Array) -> float:
    """Ln |dx/dz| by central differences."""
    step = 1e-6 * np.maximum(np.abs(z), 0.1 * np.minimum(there.upper - there.lower, 1.0))
    scale = np.abs(there.inverse(z[None])[0][0]) + 1e-12
    ends = [there.inverse(z + side * np.diag(step))[0] for side in (1.0, -1.0)]
    slopes = (ends[0] - ends[1]) / (2.0 * step[:, None])
    return float(np.linalg.slogdet(slopes / scale)[1] + np.log(scale).sum())


@pytest.mark.parametrize('name', CASES)
def test_a_transform_is_one_to_one_with_the_jacobian_it_says(name: str) -> None:
    there, x = CASES[name]()
    z = there.forward(x)
    assert (z >= there.lower).all() and (z <= there.upper).all()
    back, log_jacobian = there.inverse(z)
    # What forward had to move inside the bounds is no point to come back to.
    kept = np.isfinite(log_jacobian) & (z > there.lower).all(axis=1) & (z < there.upper).all(1)
    assert kept.sum() >= 3
    assert np.allclose(back[kept], x[kept], rtol=1e-6, atol=1e-12)
    expected = np.array([_determinant(there, at) for at in z[kept]])
    assert np.ptp(log_jacobian[kept] - expected) < 1e-3


@pytest.mark.parametrize('name', ['log', 'ridge, linear, k=0', 'ridge, backlash, k=250000'])
def test_beyond_the_bounds_of_the_parameters_there_is_nothing(name: str) -> None:
    there, x = CASES[name]()
    z = there.forward(x)
    z[:, 1] -= 30.0  # of a ridge: a loop faster than beta_1 allows
    assert np.isneginf(there.inverse(z)[1]).all()


def test_what_is_bent_becomes_straight() -> None:
    rng = np.random.default_rng(3)
    wide, thin = rng.standard_normal((2, 2000))
    bent = np.stack([wide, 0.3 * wide**2 + 0.02 * thin], axis=1)
    straight = Triangular(bent).forward(bent)
    for known in (straight[:, 0], straight[:, 0] ** 2):
        assert abs(np.corrcoef(known, straight[:, 1])[0, 1]) < 0.1
    # In the plane the bend is fifteen times as wide as the ridge.
    near = np.abs(straight[:, 0]) < 2.0
    assert straight[near, 1].std() == pytest.approx(1.0, abs=0.2)


def test_an_unknown_direction_takes_no_digits_from_the_known_ones() -> None:
    """At k = 0 alpha_3 has no curvature to speak of; beta_1 must keep its spread all the same."""
    known = np.array([[5e-5, 1e-7], [1e-7, 4e-10]])
    covariance = np.zeros((4, 4))
    covariance[:2, :2] = known
    covariance[2, 2] = 6e15
    covariance[2, :2] = covariance[:2, 2] = (1e3, 1e1)
    root = Laplace(np.zeros(4), covariance, np.full(4, 7.0)).root
    assert (root @ root.T)[3, 3] == pytest.approx(49.0)
    np.testing.assert_allclose((root @ root.T)[:2, :2], known, rtol=1e-9)
