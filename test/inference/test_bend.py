"""The bend of a cloud of points: found where there is one, taken off, put on again."""

from __future__ import annotations

import numpy as np
import pytest
import targets

from actuator_glue.inference import bend, student
from actuator_glue.inference.dream import SamplerSettings, init, stretch
from actuator_glue.records import Array


def _fitted(points: Array) -> tuple[bool, Array, Array, Array]:
    """Whether points bend; their centre, and the directions along and across."""
    d = points.shape[1]
    centre, factor = np.empty(d), np.empty((d, d))
    student.fit(points, centre, factor)
    along, across = np.empty(d), np.empty(d)
    return bend.fit(points, centre, factor, along, across), centre, along, across


@pytest.mark.parametrize('order', [np.arange(10), np.arange(10)[::-1]], ids=['first', 'last'])
def test_a_banana_is_straightened_whatever_the_order_of_its_coordinates(
    order: Array, rng_seed: int
) -> None:
    points = targets.banana().draw(np.random.default_rng(rng_seed), 2000)[:, order]
    found, centre, along, across = _fitted(points)
    assert found and abs(along @ across) < 1e-9 * np.linalg.norm(along) * np.linalg.norm(across)
    straight = points.copy()
    for row in straight:
        bend.shift(row, centre, along, across, -1.0)
    # What is left is the normal that was twisted, perhaps sheared: of volume 10. Of 200 sets of
    # points the largest left 22.
    before, after = (np.sqrt(np.linalg.det(np.cov(p.T))) for p in (points, straight))
    assert before > 100.0 and 8.0 < after < 40.0
    for row in straight:
        bend.shift(row, centre, along, across, 1.0)
    assert np.allclose(straight, points, atol=1e-9)


@pytest.mark.parametrize(('dimension', 'size'), [(4, 300), (10, 1200)])
def test_normal_points_do_not_bend(dimension: int, size: int, rng_seed: int) -> None:
    """None of 8000 sets of points did."""
    target = targets.equicorrelated(dimension)
    for rng in np.random.default_rng(rng_seed).spawn(20):
        found, _, along, across = _fitted(target.draw(rng, size))
        assert not found and not along.any() and not across.any()


def test_chains_start_wider_than_they_end(rng_seed: int) -> None:
    """R-hat compares chains that began further apart than the posterior is wide.

    The variance of 300 starts is 1.53 +- 0.10 of the posterior's over 150 seeds, that of their
    ends 0.96 +- 0.06: outside of these limits by chance once in 5000 runs.
    """
    target = targets.equicorrelated(4)
    rng = np.random.default_rng(rng_seed)
    settings = SamplerSettings(chains=300, population=2000)
    state = init(rng, target.log_density, target.lower, target.upper, settings)
    started = ((state.now.x / target.sd) ** 2).mean()
    state, _ = stretch(rng, state, 60)
    assert started > 1.15
    assert ((state.now.x / target.sd) ** 2).mean() == pytest.approx(1.0, abs=0.25)
