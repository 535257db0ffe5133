"""A move is one file: one from outside is tuned, counted and published as the others are."""

from __future__ import annotations

import numpy as np
import pytest
import targets

from actuator_glue.inference import dream
from actuator_glue.inference.moves import MOVES
from actuator_glue.inference.moves.move import (
    NO_CLASS,
    U_FREE,
    Move,
)
from actuator_glue.inference.settings import SamplerSettings
from actuator_glue.jit import njit


@njit(cache=False)
def _uniform_step(z, uniforms, rows, size, tuning, knobs, scratch, candidate):
    """A walk of one coordinate, a standard deviation either way; no archive, no correction."""
    at = min(int(uniforms[U_FREE] * z.size), z.size - 1)
    candidate[:] = z
    candidate[at] += tuning.scale[at] * 2.0 * (2.0 * uniforms[U_FREE + 1] - 1.0)
    return 0.0, NO_CLASS


@pytest.mark.slow
@pytest.mark.parametrize(
    'share',
    [
        pytest.param(0.5, id='fixed'),
        pytest.param(None, id='by what it achieves'),
    ],
)
def test_a_fourth_move_is_registered_from_outside(share: float | None, rng_seed: int) -> None:
    """It is made as often as it says, samples right, and crossover statistics stay in place."""
    walk = Move('walk', _uniform_step, lambda dimension, pairs: 2, share=share, most=0.5)
    settings = SamplerSettings(moves=(*MOVES, walk), adaptation=50)
    target = targets.scales()
    runs = []
    for rng in np.random.default_rng(rng_seed).spawn(8):
        run = dream.sample(
            rng,
            target.log_density,
            target.lower,
            target.upper,
            evaluations=15_000,
            settings=settings,
        )
        scores = (run.posterior() - target.mean) / target.sd
        runs.append(np.append(scores.mean(axis=0), (scores**2).mean(axis=0)))
    truth = np.repeat((0.0, 1.0), 4)
    assert (np.abs(targets.t_values(np.array(runs), truth)) < targets.t_limit(8, 8, 1e-6)).all()

    rng = np.random.default_rng(rng_seed)
    state = dream.init(rng, target.log_density, target.lower, target.upper, settings)
    state = state._replace(counts=np.zeros_like(state.counts), settings=settings)
    made: list[int] = []
    classes = np.zeros(settings.crossovers)
    for _ in range(40):
        state, info = dream.step(rng, state)
        made += info.move.tolist()
        classes += np.bincount(info.crossover[info.crossover >= 0], minlength=len(classes))
    uses = state.counts[:, 0]
    assert np.array_equal(uses[:4], np.bincount(made, minlength=4)) and uses[3] > 0
    assert np.array_equal(uses[4:], classes)
    if share is not None:
        assert abs(np.mean(np.array(made) == 3) - share) < 0.1
