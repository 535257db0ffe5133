"""pints: its DREAM and its default adaptive Metropolis, in logit coordinates.

In physical units pints' DREAM cannot work here: its jitter is as wide as the mean of the start.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pints

from actuator_glue.records import Array
from benchmarks.peers.common import LOWER, UPPER, LogDensity, Sampler

CHAINS = 8


def _runner(method: Any) -> Any:
    def run(
        density: LogDensity,
        start: Array | None,
        history: Array | None,
        evaluations: int,
        seed: int,
    ) -> Array:
        np.random.seed(seed)  # noqa: NPY002 - pints has no other way

        class PintsPosterior(pints.LogPDF):
            def n_parameters(self) -> int:
                return 4

            def __call__(self, theta: Array) -> float:
                return float(density(theta)[0])

        if start is None:
            start = np.random.default_rng(seed).uniform(LOWER, UPPER, (CHAINS, 4))
        controller = pints.MCMCController(
            PintsPosterior(),
            CHAINS,
            list(start),
            method=method,
            transformation=pints.RectangularBoundariesTransformation(LOWER, UPPER),
        )
        controller.set_max_iterations(evaluations // CHAINS)
        controller.set_log_to_screen(False)
        return np.swapaxes(controller.run(), 0, 1)

    return run


SAMPLERS = {
    'pints DREAM': Sampler(
        _runner(pints.DreamMCMC), CHAINS, '8 chains, logit coordinates', 100_000, 60_000
    ),
    'pints Haario-Bardenet': Sampler(
        _runner(pints.HaarioBardenetACMC), CHAINS, '8 chains, logit coordinates', 100_000, 60_000
    ),
}
