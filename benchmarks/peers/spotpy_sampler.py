"""spotpy: its DREAM with the acceptance rule that suits a log likelihood (its default is not)."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path

import numpy as np
import spotpy

from actuator_glue.records import Array
from benchmarks.peers.common import LOWER, UPPER, LogDensity, Sampler

CHAINS = 7


def run(
    density: LogDensity, start: Array | None, history: Array | None, evaluations: int, seed: int
) -> Array:
    """DREAM of spotpy; acceptance rule 2 is Metropolis on the log likelihood."""
    np.random.seed(seed)  # noqa: NPY002 - spotpy has no other way

    class SpotpySetup:
        def __init__(self) -> None:
            self.params = [spotpy.parameter.Uniform(f'p{j}', LOWER[j], UPPER[j]) for j in range(4)]

        def parameters(self) -> object:
            return spotpy.parameter.generate(self.params)

        def simulation(self, vector: object) -> list[float]:
            return [float(density(np.array(list(vector)))[0])]

        def evaluation(self) -> list[float]:
            return [0.0]

        def objectivefunction(
            self, simulation: list[float], evaluation: list[float], params: object = None
        ) -> float:
            return simulation[0]

    with Path(os.devnull).open('w') as nowhere, contextlib.redirect_stdout(nowhere):
        sampler = spotpy.algorithms.dream(
            SpotpySetup(), dbname='none', dbformat='ram', save_sim=False, random_state=seed
        )
        if start is not None:
            sampler.get_regular_startingpoint = lambda _: start
        sampler.sample(
            evaluations, nChains=CHAINS, delta=3, convergence_limit=0.0, acceptance_test_option=2
        )
    generations = evaluations // CHAINS - 1
    return np.stack([np.asarray(sampler.bestpar[c][:generations]) for c in range(CHAINS)], axis=1)


SAMPLERS = {
    'spotpy DREAM': Sampler(run, CHAINS, '7 chains, acceptance_test_option=2', 20_000, 10_000)
}
