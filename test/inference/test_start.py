"""A start that one point took over is begun anew."""

import numpy as np
import pytest

from actuator_glue.inference.anneal import anneal, prior_reference
from actuator_glue.inference.settings import SamplerSettings
from actuator_glue.inference.start import population
from actuator_glue.inference.transforms.log import Log
from actuator_glue.records import Array

SETTINGS, BOX = SamplerSettings(), Log(np.full(3, 1.0), np.full(3, 3.0))


class Spike:
    """A hill, and some of the first points far above it: no move leads there or away.

    Some, as the one may not be among the few that chains start from.
    """

    def __init__(self) -> None:
        self.at: Array | None = None

    def __call__(self, x: Array) -> Array:
        """Log likelihood (m,) of points (m, 3)."""
        if self.at is None:
            self.at = x[:4].copy()
        hill = -0.5 * ((x - 2.0) ** 2).sum(axis=1) / 0.05**2
        return np.where((x[:, None] == self.at).all(axis=2).any(axis=1), 1e4, hill)


@pytest.mark.parametrize('last', [False, True])
def test_one_point_takes_over(last: bool, rng_seed: int) -> None:
    """It is told, or led to the last temperature where nothing else is left.

    Of 300 seeds none failed.
    """
    rng = np.random.default_rng(rng_seed)
    reference = prior_reference(rng, SETTINGS.points(3), BOX)
    found = anneal(rng, Spike(), BOX, reference, SETTINGS, last=last)
    assert found.collapsed is not last
    assert (found.power == 1.0) is last


def test_the_next_start_is_another(rng_seed: int) -> None:
    """All evaluations count; what is left is around the hill. Of 300 seeds none failed."""
    rng = np.random.default_rng(rng_seed)
    found = population(rng, Spike(), BOX, SETTINGS, None, None)
    assert found.power == 1.0 and not found.collapsed
    assert found.points.log_density.max() <= 0.0
    np.testing.assert_allclose(np.median(found.points.x, axis=0), 2.0, atol=0.05)
    assert found.evaluations > 2 * SETTINGS.points(3)


def test_few_evaluations_end_the_search(rng_seed: int) -> None:
    """What was spent does not exceed the limit, however often it begins. No false failures."""
    rng, limit = np.random.default_rng(rng_seed), 3 * SETTINGS.points(3)
    found = population(rng, Spike(), BOX, SETTINGS, None, limit)
    assert found.evaluations <= limit
