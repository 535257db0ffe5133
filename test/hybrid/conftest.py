"""What tests of hybrid simulation share."""

from collections.abc import Callable

import numpy as np
import pytest

import actuator_glue as ag
from actuator_glue.api.calibration_parts import CalibratedRecord, FitError, Marginal
from actuator_glue.model.benchmark_plant import BenchmarkParameters
from actuator_glue.model.structure import Structure

STATIC_GAIN = 1.0261  # of the benchmark's plant


def calibration(draws: np.ndarray, effects: tuple[str, ...]) -> ag.Calibration:
    """A calibration with these draws (m, p), m a multiple of four; no sampler involved."""
    parameters = Structure(effects).parameters
    mean = draws.mean(axis=0)
    marginals = {
        p.name: Marginal(c, 1.0, 0.0, 1.0, 1.0, len(draws), c, p.unit, (p.lower, p.upper), False)
        for p, c in zip(parameters, map(float, mean), strict=True)
    }
    return ag.Calibration(
        parameters=marginals,
        draws=draws.reshape(-1, 4, len(mean)),
        log_density=np.zeros((len(draws) // 4, 4)),
        best=mean,
        error=FitError(0.0, 0.0, ()),
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
        sources=(CalibratedRecord('test', 1, 200.0, 1.2e6, 'zoh'),),
    )


@pytest.fixture(scope='session')
def benchmark_draws() -> Callable[..., ag.Calibration]:
    """The benchmark's plant and its spread as a posterior: Eq. (2) with three effects is it."""

    def make(count: int, more: tuple[str, ...] = (), seed: int = 0) -> ag.Calibration:
        effects = ('gain', 'valve-lag', 'payload-inertia', *more)
        structure = Structure(effects)
        rng = np.random.default_rng(seed)
        rows = []
        for _ in range(count):
            p = BenchmarkParameters().drawn(rng)
            row = structure.neutral(
                np.array([p.beta2 / p.beta1, p.a1_beta0 / p.beta1, p.a2, p.a3])
            )
            for name, value in (
                ('gain', STATIC_GAIN),
                ('valve_lag', 1.0 / p.beta1),
                ('mass', p.mass),
                ('mass_damping', p.damping / p.mass),
            ):
                row[structure.names.index(name)] = value
            rows.append(row)
        return calibration(np.array(rows), effects)

    return make
