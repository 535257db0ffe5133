"""Delay margins held to closed forms, to the benchmark's reference values, and to simulation."""

import numpy as np
import pytest

from actuator_glue.api.frequency_response import Limits
from actuator_glue.api.hybrid_meaning import hybrid_meaning
from actuator_glue.hybrid.coupled import coupled
from actuator_glue.hybrid.linear_system import System, closed, crossings, held, series
from actuator_glue.hybrid.margin import (
    classical_margins,
    delay_margin,
    nominal,
    psi,
    pure_delay_margin,
    sampled_delay_margin,
)
from actuator_glue.hybrid.partition import Partition, Specimen
from actuator_glue.hybrid.watch import MarginWatch
from actuator_glue.io.partition import read_partition
from actuator_glue.model.benchmark_plant import BenchmarkParameters

# tau_c [ms], rightmost pole [1/s] with the uncompensated plant, natural frequencies [Hz].
BENCHMARK = (
    (14.642, 0.523, (3.612, 15.997, 38.086)),
    (12.222, 0.656, (3.444, 15.252, 36.314)),
    (9.921, 0.716, (3.168, 14.030, 33.404)),
    (8.726, 0.955, (3.612, 15.997, 38.086)),
)
STATIC_GAIN = 1.0261  # of the benchmark's plant
STIFF = Specimen(0.0, 0.0, 250e3)
NAMES = ('beta_1', 'alpha_1_beta_0', 'alpha_2', 'alpha_3')
THETA = np.array([[133.65, 1.1005e9, 2.4927e5, 0.006], [200.0, 1.1005e9, 2.4927e5, 0.006]])


def sdof(damping: float, alpha: float, mass: float = 0.0, rate: float = 4096.0) -> Partition:
    """A structure of period 1 s, alpha of its stiffness in the specimen."""
    w = 2.0 * np.pi
    return Partition(
        mass=1000.0 - mass,
        damping=2.0 * damping * w * 1000.0,
        stiffness=(1.0 - alpha) * w**2 * 1000.0,
        specimen=Specimen(mass, 0.0, alpha * w**2 * 1000.0),
        rate=rate,
    )


def plant() -> System:
    """The benchmark's transfer system without its sensors."""
    p = BenchmarkParameters()
    A = np.zeros((1, 5, 5))
    A[0, 0, 1] = A[0, 2, 0] = A[0, 3, 4] = 1.0
    A[0, 1, [0, 1, 3]] = -p.beta2, -p.beta1, -p.a1_beta0
    A[0, 2, [2, 4]] = -p.a3, -p.a2
    A[0, 4, [2, 3, 4]] = np.array([1.0, -p.stiffness, -p.damping]) / p.mass
    B, C = np.zeros((1, 5)), np.zeros((1, 5))
    B[0, 1], C[0, 3] = p.a1_beta0, STATIC_GAIN
    return System(A, B, C, np.zeros(1))


@pytest.mark.parametrize(
    ('damping', 'alpha', 'ms'), [(0.05, 1.0, 15.942), (0.02, 1.0, 6.368), (0.05, 0.5, 32.045)]
)
def test_sdof(damping: float, alpha: float, ms: float) -> None:
    """The table of reference values."""
    assert 1e3 * pure_delay_margin(sdof(damping, alpha))[0] == pytest.approx(ms, rel=1e-4)


@pytest.mark.parametrize('case', range(4))
def test_benchmark(case: int) -> None:
    """Silva et al. (2020): margins, frequencies, and the growth with its plant in the loop."""
    tau, pole, frequencies = BENCHMARK[case]
    partition = read_partition(f'benchmark_case_{case + 1}')
    continuous, sampled = pure_delay_margin(partition)
    assert 1e3 * continuous == pytest.approx(tau, rel=1e-3)
    assert psi(continuous) == pytest.approx(np.log10(tau), abs=1e-3)
    assert partition.natural_frequencies == pytest.approx(frequencies, abs=6e-4)
    roots = np.linalg.eigvals(closed(series(nominal(partition), plant()))[0])
    assert roots.real.max() == pytest.approx(pole, rel=1e-3)
    # Half a sample for the force that is held.
    assert continuous - sampled == pytest.approx(0.5 / 4096.0, rel=0.06)


@pytest.mark.parametrize('seed', range(5))
def test_a_delay_on_either_side_of_the_margin(seed: int) -> None:
    """The sampled loop with whole samples of delay: stable below its margin, unstable above."""
    rng = np.random.default_rng(seed)
    rate = float(rng.uniform(200.0, 2000.0))
    partition = sdof(rng.uniform(0.01, 0.1), rng.uniform(0.3, 1.0), rng.uniform(0.0, 300.0), rate)
    loop = nominal(partition)
    tau = float(sampled_delay_margin(loop, partition.period)[0][0])
    discrete = held(loop, partition.period)
    for samples, stable in ((int(tau * rate), True), (int(tau * rate) + 1, False)):
        delayed = discrete
        for _ in range(samples):
            one = System(np.zeros((1, 1, 1)), np.ones((1, 1)), np.ones((1, 1)), np.zeros(1))
            delayed = series(delayed, one)
        radius = np.abs(np.linalg.eigvals(closed(delayed))).max()
        assert (radius < 1.0) == stable


def test_a_delay_of_a_part_of_a_sample() -> None:
    """The modified z-transform: held input, 2.3 samples late, against steps of a tenth of one."""
    rng = np.random.default_rng(3)
    A = np.array([[[0.0, 1.0], [-400.0, -8.0]]])
    system = System(A, np.array([[0.0, 1.0]]), np.array([[1.0, 0.0]]), np.zeros(1))
    u = rng.standard_normal(40)
    fine = held(system, 0.001)
    late = np.concatenate([np.zeros(23), np.repeat(u, 10)])[:400]
    x, slow = np.zeros(2), []
    for i, value in enumerate(late):
        if i % 10 == 0:
            slow.append(x[0])
        x = fine.A[0] @ x + fine.B[0] * value
    coarse = held(system, 0.01, np.array([0.023]))
    y, fast = np.zeros(len(coarse.B[0])), []
    for value in u:
        fast.append(coarse.C[0] @ y)
        y = coarse.A[0] @ y + coarse.B[0] * value
    np.testing.assert_allclose(fast, slow, atol=1e-12)


def test_crossings_are_those_of_a_fine_grid() -> None:
    """No sharp resonance is missed, and none invented."""
    loop = nominal(read_partition('benchmark_case_4'))
    w = np.linspace(0.5, 300.0, 300_001)
    gain = np.abs(loop.response(1j * w[None]))[0]
    seen = w[np.flatnonzero(np.diff(np.sign(gain - 1.0)))]
    found = np.sort(crossings(loop)[0])
    np.testing.assert_allclose(found[~np.isnan(found)], seen, atol=2e-3)


def test_python_control_agrees() -> None:
    """The delay margin of one crossing is its phase margin over its frequency."""
    loop = nominal(read_partition('sdof'))
    w = np.nanmax(crossings(loop))
    phase = classical_margins(loop).phase_deg
    assert phase is not None
    assert np.radians(phase) / w == pytest.approx(delay_margin(loop)[0][0], rel=1e-6)


def test_no_delay_is_borne_by_a_heavy_specimen() -> None:
    """More experimental than numerical mass: unstable with any delay, sampled or not."""
    partition = sdof(0.05, 0.5, mass=600.0)
    assert pure_delay_margin(partition) == (0.0, 0.0)
    assert psi(0.0) is None


@pytest.mark.parametrize('rate', [100.0, 200.0, 330.0, 340.0, 1000.0, 4096.0])
def test_a_held_force_may_spend_more_than_the_loop_bears(rate: float) -> None:
    """1.5 ms by pure delay, of which the hold takes half a sample."""
    partition = Partition([[1000.0]], [[374.0]], [[1e5]], Specimen(0.0, 0.0, 250e3), rate)
    continuous, sampled = pure_delay_margin(partition)
    assert 1e3 * continuous == pytest.approx(1.496, rel=1e-3)
    assert sampled == pytest.approx(continuous - 0.5 / rate, abs=3e-5)
    late = Limits(*np.full((3, 1), 0.02))
    said = hybrid_meaning(partition, lambda stiffness, frequency: late)
    assert ('it bears no delay at all' in said) == (sampled < 0.0)
    assert 'unstable' in said


def test_a_soft_specimen_bears_every_delay() -> None:
    """Where the gain is nowhere 1 nothing limits the delay."""
    assert pure_delay_margin(sdof(0.3, 0.1))[0] == np.inf


def shaken(partition: Partition, seed: int, damping: float) -> Partition:
    """The partition with a second structure that the interface neither moves nor feels.

    Hidden: the other degrees of freedom are combinations of both structures'.
    """
    rng = np.random.default_rng(seed)
    n, m = len(partition.mass), int(rng.integers(1, 4))
    turn = np.eye(n + m)
    turn[1:, 1:] = np.linalg.qr(rng.standard_normal((n + m - 1, n + m - 1)))[0]
    mass, stiffness = np.diag(rng.uniform(300.0, 2e3, m)), np.diag(rng.uniform(0.0, 1e6, m))
    if seed % 2:  # of one frequency
        mass, stiffness = 1e3 * np.eye(m), 1e6 * np.eye(m)
    beside = mass, 2.0 * damping * np.sqrt(mass * stiffness), stiffness
    matrices = []
    for own, other in zip(
        (partition.mass, partition.damping, partition.stiffness), beside, strict=True
    ):
        both = turn @ np.block([[own, np.zeros((n, m))], [np.zeros((m, n)), other]]) @ turn.T
        matrices.append(0.5 * (both + both.T))
    return Partition(*matrices, partition.specimen, partition.rate)


def storeys(seed: int, damping: float) -> Partition:
    """Two to five storeys on springs; the actuator and the only damper are at the first."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 6))
    k = rng.uniform(1e4, 1e6, n + 1)
    stiffness = np.diag(k[:-1] + k[1:]) - np.diag(k[1:-1], 1) - np.diag(k[1:-1], -1)
    only = np.zeros((n, n))
    only[0, 0] = damping
    mass = np.diag(rng.uniform(300.0, 2000.0, n))
    return Partition(mass, only, stiffness, Specimen(0.0, 0.0, rng.uniform(1e4, 1e6)), 1000.0)


@pytest.mark.parametrize('seed', range(1, 13))
def test_what_the_actuator_does_not_see_limits_nothing(seed: int) -> None:
    """An undamped mode beside the loop gave 0.67 ms for 4.0, or no answer at all."""
    for plain in (Partition([[1e3]], [[1e3]], [[1e5]], STIFF, 1000.0), storeys(seed, 1e3)):
        for damping in (0.0, 1e-7):
            both = shaken(plain, seed, damping)
            assert pure_delay_margin(both) == pytest.approx(pure_delay_margin(plain), rel=1e-6)
            told, expected = (MarginWatch(p).take(THETA, NAMES, (), 2.0) for p in (both, plain))
            np.testing.assert_allclose(told.growth, expected.growth, rtol=1e-6)
            np.testing.assert_allclose(told.margin, expected.margin, rtol=1e-3)


def test_the_ground_moves_what_the_actuator_sees_as_before() -> None:
    """The same modes, with the same participation."""
    plain = storeys(3, 1e3)
    seen, before = coupled(shaken(plain, 2, 0.0)), coupled(plain)
    np.testing.assert_allclose(seen.natural_frequencies, plain.natural_frequencies, rtol=1e-6)
    np.testing.assert_allclose(before.natural_frequencies, plain.natural_frequencies, rtol=1e-6)
    for partition in (plain, before):
        moved = partition.load @ np.linalg.solve(partition.whole[0], partition.load)
        assert moved == pytest.approx(plain.whole[0].sum())


@pytest.mark.parametrize('seed', range(1, 13))
def test_an_undamped_structure_that_is_coupled_bears_nothing(seed: int) -> None:
    """However well the mode hides: the smallest delay makes it grow."""
    assert pure_delay_margin(storeys(seed, 0.0))[0] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize('seed', range(1, 13))
def test_the_held_force_takes_half_a_sample_of_hardly_damped_loops_too(seed: int) -> None:
    """Resonances so sharp that rounding decided on which side of them the gain is one."""
    continuous, sampled = pure_delay_margin(storeys(seed, 1e3))
    assert sampled == pytest.approx(continuous - 0.5e-3, abs=1.5e-4)


@pytest.mark.parametrize('rate', [1.0, 2.0, 6.0])
def test_an_undamped_structure_of_any_frequency_has_a_margin(rate: float) -> None:
    """A pole on the axis, at 1 rad/s as anywhere, is no place where a response is asked for."""
    k = 1000.0 * rate**2
    pure, sampled = pure_delay_margin(Partition(1000.0, 0.0, k, Specimen(0.0, 0.0, k), 1024.0))
    assert (pure, sampled) == (0.0, pytest.approx(-0.5 / 1024.0, rel=1e-5))


def test_a_structure_that_is_itself_unstable_has_no_margin() -> None:
    """It lacks the lead that takes its negative damping back: c/k of the specimen."""
    pure, sampled = pure_delay_margin(
        Partition(1000.0, -10.0, 2e4, Specimen(0.0, 0.0, 2e4), 1024.0)
    )
    assert (pure, sampled) == (
        pytest.approx(-10.0 / 2e4, rel=1e-4),
        pytest.approx(-10.0 / 2e4 - 0.5 / 1024.0, rel=1e-3),
    )


@pytest.mark.filterwarnings('error')
def test_a_specimen_of_the_numerical_mass_bears_no_delay() -> None:
    """The gain is 1 at infinity: no crossing, and nothing is divided by nothing."""
    heavy = Partition(1000.0, 100.0, 2e4, Specimen(1000.0, 0.0, 2e4), 1024.0)
    assert pure_delay_margin(heavy)[0] == 0.0
