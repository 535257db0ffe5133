"""emcee: the stretch move, and differential evolution with snooker, both vectorised."""

from __future__ import annotations

from typing import Any

import emcee
import numpy as np

from actuator_glue.records import Array
from benchmarks.peers.common import LOWER, UPPER, LogDensity, Sampler

WALKERS = 64


def _runner(moves: Any) -> Any:
    def run(
        density: LogDensity,
        start: Array | None,
        history: Array | None,
        evaluations: int,
        seed: int,
    ) -> Array:
        rng = np.random.default_rng(seed)
        if start is None:
            start = rng.uniform(LOWER, UPPER, (WALKERS, 4))
        np.random.seed(seed)  # noqa: NPY002 - emcee has no other way
        sampler = emcee.EnsembleSampler(WALKERS, 4, density, moves=moves, vectorize=True)
        # One iteration of emcee evaluates each walker once.
        sampler.run_mcmc(start, evaluations // WALKERS)
        return np.asarray(sampler.get_chain())

    return run


SAMPLERS = {
    'emcee stretch': Sampler(
        _runner(emcee.moves.StretchMove()), WALKERS, '64 walkers, vectorised', 1_000_000, 300_000
    ),
    'emcee DE + snooker': Sampler(
        _runner([(emcee.moves.DEMove(), 0.8), (emcee.moves.DESnookerMove(), 0.2)]),
        WALKERS,
        '64 walkers, DEMove 0.8, DESnookerMove 0.2, vectorised',
        1_000_000,
        300_000,
    ),
}
