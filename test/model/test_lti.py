"""Linear effects: the exact path against the scheme of all effects, and for what it costs."""

from __future__ import annotations

import numpy as np
import pytest

from actuator_glue.model.commands import sweep
from actuator_glue.model.effects import CATALOGUE, run
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array, Record

RATE = 256.0
U = sweep(RATE, duration=6.0, f0=0.5, f1=10.0, amplitude=2e-3)
THETA = [128.0, 1.01e9, 2.42e5, 0.06]
SIZES = {
    'delay': [0.0117],  # 2.995 samples
    'gain': [0.93],
    'valve-lag': [0.003],
    'viscous-damping': [3e4],
    'payload-inertia': [400.0, 60.0],
    'sensor-lag': [0.004],
}
SETS = [*((name,) for name in SIZES), ('delay', 'valve-lag', 'sensor-lag'), tuple(SIZES)]


def scheme(structure: Structure, theta: Array, record: Record, rate: int) -> Array:
    """The response by the scheme that nonlinear effects need, sub-steps `rate` times finer."""
    values = structure.values(theta[np.newaxis])
    parts = run.blocks(values, structure.switches, structure.program, record, (1e-4, 0.02), rate)
    return np.concatenate([x[:, 0].copy() for _, _, x in parts])


@pytest.mark.parametrize('hold', ['zoh', 'linear'])
@pytest.mark.parametrize('stiffness', [0.0, 250e3])
@pytest.mark.parametrize('effects', SETS)
def test_the_scheme_converges_to_the_exact_path(
    effects: tuple[str, ...], stiffness: float, hold: str
) -> None:
    """Second order: four times finer sub-steps leave at most a tenth of the difference."""
    structure = Structure(effects)
    theta = np.array(THETA + [v for name in effects for v in SIZES[name]])
    record = Record(U, U, 1.0 / RATE, stiffness, hold=hold)
    values = structure.values(theta[np.newaxis])
    parts = run.exact_blocks(values, *structure.exact, record, (1e-4, 0.02))
    exact = np.concatenate([x[:, 0].copy() for _, _, x in parts])
    errors = [
        float(np.abs(scheme(structure, theta, record, rate) - exact).max()) for rate in (2, 8)
    ]
    assert errors[0] < 1e-6
    assert errors[1] < 0.1 * errors[0] + 1e-12


def test_a_vanishing_time_constant_is_none() -> None:
    """No jump where a state is left out because nothing of it can be seen."""
    record = Record(U, U, 1.0 / RATE, 250e3)
    for name, low, high in (
        ('valve-lag', [1e-9 * 0.999], [1e-9 * 1.001]),
        ('sensor-lag', [1e-9 * 0.999], [1e-9 * 1.001]),
        ('payload-inertia', [1e-12, 500.0], [1e-6, 500.0]),
        ('viscous-damping', [1e-7], [1e-3]),
    ):
        structure = Structure((name,))
        y = structure.simulate(np.array([THETA + low, THETA + high]), record)
        assert np.abs(y[0] - y[1]).max() < 1e-9, name


def test_every_linear_effect_takes_the_exact_path() -> None:
    """And one that is not keeps the structure off it."""
    assert all(Structure((name,)).linear for name in SIZES)
    assert {e.name for e in CATALOGUE.values() if e.exact} <= set(SIZES)
    assert not Structure(('delay', 'backlash')).linear
    assert not Structure(('clock-skew',)).linear
