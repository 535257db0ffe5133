"""Simulated actuators: cut into blocks anyhow, and against scipy."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import signal

from actuator_glue.errors import InputError
from actuator_glue.model import linear
from actuator_glue.model.benchmark_plant import (
    STROKE,
    BenchmarkParameters,
    benchmark_plant,
)
from actuator_glue.model.commands import noise, sweep
from actuator_glue.model.effects import layout
from actuator_glue.model.parameters import TABLE_2
from actuator_glue.model.plant import MeasuredPlant, Plant
from actuator_glue.model.sensor import SensorSpec
from actuator_glue.model.stream import Stream
from actuator_glue.model.structure import Structure

HOLDS = ('zoh', 'linear')
QUIET = SensorSpec()


def paper_plant(hold='zoh', stiffness=250e3, effects=()):
    """Eq. (2) with Table 2's parameters and effects of a typical size."""
    structure = Structure(effects)
    sizes = {'delay': [4e-3], 'backlash': [2e-5], 'coulomb-friction': [300.0]}
    theta = np.concatenate([TABLE_2, *[sizes[name] for name in effects]])
    return Stream(structure, theta, stiffness=stiffness, period=1e-3, hold=hold)


def make_plant(kind, hold, seed=0) -> Plant:
    if kind == 'benchmark':
        return benchmark_plant(period=1e-3, hold=hold, seed=seed)
    effects = () if kind == 'paper' else ('delay', 'backlash')
    return MeasuredPlant(
        paper_plant(hold, effects=effects),
        SensorSpec(noise=2e-5, bits=18, span=0.01),
        SensorSpec(noise=3.0),
        seed,
    )


@settings(max_examples=40, deadline=None)
@given(
    kind=st.sampled_from(['paper', 'effects', 'benchmark']),
    hold=st.sampled_from(HOLDS),
    cuts=st.lists(st.integers(0, 500), max_size=30),
    seed=st.integers(0, 2**16),
)
def test_output_does_not_depend_on_the_blocks(kind, hold, cuts, seed):
    u = noise(1000.0, 0.5, 1.0, 20.0, 5e-3, seed)
    plant = make_plant(kind, hold, seed)
    whole = plant.step(u)
    plant.reset()
    edges = [0, *sorted(cuts), len(u)]
    parts = [plant.step(u[a:b]) for a, b in pairwise(edges)]
    for channel in (0, 1):
        np.testing.assert_array_equal(whole[channel], np.concatenate([p[channel] for p in parts]))


def test_an_empty_first_block_writes_nothing():
    # Guarded memory around the output: a write past it would only sometimes crash.
    plant = paper_plant(effects=('delay', 'backlash'))
    memory = np.full((3, layout.LANES), 7.0)
    out, force = memory[1:1], np.empty((0, layout.LANES))
    plant._advance(np.zeros(1), out, force)
    assert (memory == 7.0).all()


@pytest.mark.parametrize('kind', ['clock-skew', 'delay'])
@pytest.mark.parametrize('hold', HOLDS)
def test_a_late_command_does_not_depend_on_the_blocks(kind, hold):
    structure = Structure((kind, 'coulomb-friction'))
    theta = np.array([*TABLE_2, {'clock-skew': 2.3e-2, 'delay': 3.7e-3}[kind], 300.0])
    plant = Stream(structure, theta, stiffness=250e3, period=1e-3, hold=hold)
    u = noise(1000.0, 2.0, 1.0, 20.0, 5e-3, 1)
    whole = plant.step(u)
    plant.reset()
    parts = [plant.step(u[a:b]) for a, b in pairwise([0, 1, 2, 130, 131, 700, 1999, len(u)])]
    for channel in (0, 1):
        np.testing.assert_array_equal(whole[channel], np.concatenate([p[channel] for p in parts]))


@pytest.mark.parametrize('hold', HOLDS)
def test_paper_plant_is_equation_2_and_its_force_is_the_springs(hold):
    u = sweep(1000.0, 5.0)
    x, f = paper_plant(hold).step(u)
    expected = linear.simulate(TABLE_2, u, stiffness=250e3, period=1e-3, hold=hold)
    np.testing.assert_allclose(x, expected, atol=1e-9 * np.abs(expected).max())
    np.testing.assert_allclose(f, 250e3 * x, atol=2e-4 * np.abs(f).max())


def benchmark_transfer(p):
    """Transfer functions of displacement and force from the block diagram of the statement."""
    s = np.poly1d([1.0, 0.0])
    valve = np.poly1d([1.0, p.beta1, p.beta2])
    piston = np.poly1d([p.mass, p.damping, p.stiffness])
    oil = np.poly1d([1.0, p.a3])
    # f = (q - a2 s x)/oil, x = f/piston, q = a1_beta0 (u - x)/valve.
    whole = valve * (oil * piston + p.a2 * s) + p.a1_beta0
    return np.poly1d([p.a1_beta0]), p.a1_beta0 * piston, whole


@pytest.mark.parametrize('hold', HOLDS)
@pytest.mark.parametrize('seed', [None, 1, 2])
def test_benchmark_plant_is_its_transfer_function(hold, seed):
    p = BenchmarkParameters()
    if seed is not None:
        p = p.drawn(np.random.default_rng(seed))
        assert p != BenchmarkParameters()
    u = noise(4096.0, 2.0, 0.5, 30.0, 5e-3, 4)
    x, f = benchmark_plant(p, hold=hold, displacement=QUIET, force=QUIET).step(u)
    to_x, to_f, whole = benchmark_transfer(p)
    t = np.arange(len(u)) / 4096.0
    for ours, numerator in ((x, to_x), (f, to_f)):
        system = signal.TransferFunction(numerator.coeffs, whole.coeffs)
        _, expected, _ = signal.lsim(system, u, t, interp=hold == 'linear')
        assert np.abs(ours - expected).max() < 1e-6 * np.abs(expected).max()


def test_benchmark_second_order_reduction():
    """Fitted over 0..10 Hz its reduction is near 15.7 Hz, damping 1.15, gain 1.01."""
    to_x, _, whole = benchmark_transfer(BenchmarkParameters())
    f = np.linspace(0.2, 10.0, 100)
    s = 2j * np.pi * f
    H = to_x(s) / whole(s)
    # 1/H = (s^2 + a1 s + a0)/b0, linear in three unknowns, weighted back to errors of H.
    A = np.stack([s**2, s, np.ones_like(s)], axis=1) * H[:, np.newaxis]
    A = np.concatenate([A.real, A.imag])
    c2, c1, c0 = np.linalg.lstsq(A, np.concatenate([np.ones(100), np.zeros(100)]), rcond=None)[0]
    natural, damping = np.sqrt(c0 / c2), c1 / (2 * np.sqrt(c0 * c2))
    assert natural / (2 * np.pi) == pytest.approx(15.7, rel=0.1)
    assert damping == pytest.approx(1.15, rel=0.1)
    assert 1 / c0 == pytest.approx(1.0, abs=0.03)


def test_benchmark_sensors_have_the_stated_noise_and_resolution():
    x, f = benchmark_plant(seed=3).step(np.zeros(40_000))
    # 40 000 samples: the sd is known to 0.35 %; five of these.
    assert x.std() == pytest.approx(16e-6, rel=0.018)
    assert f.std() == pytest.approx(2.2, rel=0.018)
    step = 2 * STROKE / 2**18
    np.testing.assert_allclose(x / step, np.round(x / step), atol=1e-6)
    assert not np.array_equal(x, benchmark_plant(seed=4).step(np.zeros(40_000))[0])


def test_benchmark_controller_limits_the_stroke():
    big = benchmark_plant(displacement=QUIET, force=QUIET)
    limited = big.step(np.full(20_000, 50e-3))[0]
    big.reset()
    np.testing.assert_array_equal(limited, big.step(np.full(20_000, STROKE))[0])


def test_quantiser_clips_at_full_scale():
    spec = SensorSpec(bits=4, span=1.0)
    plant = MeasuredPlant(paper_plant(stiffness=0.0), spec)
    x, _ = plant.step(np.full(2000, 5.0))
    assert x.max() == pytest.approx(1.0 - spec.resolution)
    assert set(np.round(x / spec.resolution)) <= set(range(-8, 8))


@pytest.mark.parametrize(
    ('make', 'message'),
    [
        (lambda: paper_plant(stiffness=-5.0), 'stiffness'),
        (lambda: paper_plant().step([0.0, np.nan]), 'finite'),
        (lambda: paper_plant().step([[1.0]]), 'shape'),
        (lambda: benchmark_plant().step([0.0, np.nan]), 'not finite at sample 1'),
        (lambda: benchmark_plant().step([1e6]), 'beyond'),
        (lambda: benchmark_plant().step([[1.0]]), 'shape'),
        (lambda: benchmark_plant(period=0.0), 'period'),
        (lambda: benchmark_plant(BenchmarkParameters(mass=-1.0)), 'mass'),
        (lambda: SensorSpec(noise=-1.0), 'noise'),
        (lambda: SensorSpec(bits=0), 'bits'),
        (lambda: SensorSpec(span=0.0), 'span'),
    ],
)
def test_refusals(make, message):
    with pytest.raises(InputError, match=message):
        make()
