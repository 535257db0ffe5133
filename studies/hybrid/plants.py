"""The benchmark's plant and its published spread as a posterior; no sampler is involved."""

from __future__ import annotations

import numpy as np

import actuator_glue as ag
from studies.hybrid import library
from studies.hybrid.actuators import EFFECTS, plant


def calibration(draws: np.ndarray, effects: tuple[str, ...]) -> ag.Calibration:
    """Return a calibration with these draws (m, p), m a multiple of four."""
    parameters = library.Structure(effects).parameters
    mean = draws.mean(axis=0)
    marginals = {
        p.name: library.Marginal(
            c, 1.0, 0.0, 1.0, 1.0, len(draws), c, p.unit, (p.lower, p.upper), False
        )
        for p, c in zip(parameters, map(float, mean), strict=True)
    }
    return ag.Calibration(
        parameters=marginals,
        draws=draws.reshape(-1, 4, len(mean)),
        log_density=np.zeros((len(draws) // 4, 4)),
        best=mean,
        error=library.FitError(0.0, 0.0, ()),
        at_bound=(),
        problems=(),
        notes=(),
        converged=True,
        effects=effects,
        likelihood='glue',
        shaping_factor=256.0,
        seed=1,
        initial='rest',
        settle=0.0,
        evaluations=1,
        seconds=0.0,
        compile_seconds=0.0,
        sources=(library.CalibratedRecord('test', 1, 200.0, 1.2e6, 'zoh'),),
    )


def spread(count: int, more: tuple[str, ...] = (), seed: int = 0) -> ag.Calibration:
    """Return so many plants of the spread, further effects neutral."""
    effects = (*EFFECTS, *more)
    rng = np.random.default_rng(seed)
    known = np.stack([plant(library.BenchmarkParameters().drawn(rng)) for _ in range(count)])
    draws = library.Structure(effects).neutral(known[:, :4])
    draws[:, : known.shape[1]] = known
    return calibration(draws, effects)
