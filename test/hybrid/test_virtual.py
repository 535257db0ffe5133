"""Virtual hybrid tests: held to a plain loop, to characteristic roots, to the benchmark."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy import signal

import actuator_glue as ag
from actuator_glue.cli.main import main
from actuator_glue.hybrid import sampled
from actuator_glue.hybrid.compensator import Compensator
from actuator_glue.hybrid.design import Loop, compensator_of
from actuator_glue.hybrid.ground_motion import artificial
from actuator_glue.hybrid.indicators import TargetMotion
from actuator_glue.hybrid.virtual import Responses, VirtualTest, lags
from actuator_glue.io.partition import read_partition
from actuator_glue.model import linear

Made = Callable[..., ag.Calibration]
THETA = np.array([133.65, 1.1005e9, 2.4927e5, 0.006])
BASE = ('beta_1', 'alpha_1_beta_0', 'alpha_2', 'alpha_3')


def loop_of(partition: ag.Partition, found: ag.Calibration) -> Loop:
    """The loop of every draw, specimens drawn."""
    specimen = partition.specimen.drawn(np.random.default_rng(1), len(found.posterior))
    return Loop.of(partition, found.posterior, found.names, found.effects, specimen)


def block(loop: Loop, chosen: Compensator, ground: np.ndarray) -> Responses:
    """Run the first 32 draws."""
    return VirtualTest(
        loop.partition, loop.draws, loop.names, loop.effects, loop.specimen, chosen, ground, 1
    ).run(0)


def quiet(name: str, **changes: float) -> ag.Partition:
    """A shipped partition without sensor noise."""
    return replace(read_partition(name), displacement_noise=0.0, force_noise=0.0, **changes)


def test_a_plain_loop_gives_the_same() -> None:
    """One degree of freedom, two samples of delay, scipy's matrices, a loop in Python."""
    rate, m, c, k = 256.0, 1000.0, 600.0, 20e3
    partition = ag.Partition(
        mass=m,
        damping=c,
        stiffness=k,
        specimen=ag.Specimen(20.0, 40.0, 10e3),
        rate=rate,
        computation_delay=2.0 / rate,
    )
    ground = np.random.default_rng(2).standard_normal(512)
    coefficients = np.array([1.01, 0.03, 2e-4])
    specimen = {
        n: np.full(2, v) for n, v in (('mass', 20.0), ('damping', 40.0), ('stiffness', 10e3))
    }
    found = VirtualTest(
        partition,
        np.tile(THETA, (2, 1)),
        BASE,
        (),
        specimen,
        Compensator('inverse', coefficients),
        ground,
        1,
    ).run(0)

    A = np.array([[0.0, 1.0], [-k / m, -c / m]])
    B = np.array([[0.0, 0.0], [-1.0 / m, -(m + 20.0) / m]])
    F, G = signal.cont2discrete((A, B, np.eye(2), np.zeros((2, 2))), 1 / rate)[:2]
    n0, d2, d1, d0 = (float(v) for v in linear.coefficients(THETA, 10e3))
    P, Q = signal.cont2discrete(
        (
            np.array([[0.0, 1.0], [-d0 / d2, -d1 / d2]]),
            np.array([[0.0], [n0 / d2]]),
            np.eye(2),
            np.zeros((2, 1)),
        ),
        1 / rate,
    )[:2]
    z, x, before, late, shown = np.zeros(2), np.zeros(2), 0.0, [0.0, 0.0], []
    for acceleration in ground:
        force = 10e3 * x[0] + 40.0 * x[1] + 20.0 * (x[1] - before) * rate
        before = x[1]
        shown.append(z[0])
        bend = A[1] @ z + B[1] @ [force, acceleration]
        late.append(coefficients @ [z[0], z[1], bend])
        z = F @ z + G @ [force, acceleration]
        x = P @ x + Q[:, 0] * late.pop(0)
    np.testing.assert_allclose(found.response[:, 0, 1], shown, atol=1e-9 * np.abs(shown).max())


def test_a_model_that_leads_its_command_has_no_loop() -> None:
    """The compensator that leads belongs into the hybrid test, not into the actuator."""
    partition = quiet('benchmark_case_1')
    specimen = partition.specimen.drawn(np.random.default_rng(0), 1)
    with pytest.raises(ag.InputError, match='give the compensator to the hybrid test'):
        Loop.of(partition, np.append(THETA, 7e-3)[None], (*BASE, 'lead'), ('lead',), specimen)


def test_the_compiled_effects_step_is_the_linear_one() -> None:
    """Friction that is neutral, a delay of parts of a sample, both compensators: one response."""
    partition = quiet('benchmark_case_1', computation_delay=7e-4)
    rng = np.random.default_rng(0)
    draws = np.column_stack([THETA * (1 + 0.01 * rng.standard_normal((4, 4))), np.full(4, 2e-3)])
    specimen = partition.specimen.drawn(rng, 4)
    ground = artificial(1, 5.0).at(partition.period)
    loop = Loop.of(partition, draws, (*BASE, 'delay'), ('delay',), specimen)
    for kind in ('inverse', 'ats'):
        chosen = compensator_of(kind, loop)
        plain = block(loop, chosen, ground)
        rubbed = replace(
            loop,
            draws=np.column_stack([draws, np.zeros(4)]),
            names=(*BASE, 'delay', 'coulomb_force'),
            effects=('delay', 'coulomb-friction'),
        )
        size = np.abs(plain.response).max()
        np.testing.assert_allclose(
            block(rubbed, chosen, ground).response, plain.response, atol=1e-5 * size
        )


def test_draws_grow_as_their_roots_say(benchmark_draws: Made) -> None:
    """Uncompensated, late in a record the response grows at the rate of the rightmost root."""
    partition = quiet('benchmark_case_4')
    loop = loop_of(partition, benchmark_draws(32))
    chosen = compensator_of('none', loop)
    growth = sampled.growth(loop.numerical, loop.plants, chosen.coefficients, partition.period)
    ground = np.zeros(round(20.0 * partition.rate))
    ground[:40] = 1.0
    floor = np.abs(block(loop, chosen, ground).response[:, 2])
    quarter = len(floor) // 4
    late, early = floor[-quarter:].max(axis=0), floor[-3 * quarter : -2 * quarter].max(axis=0)
    np.testing.assert_allclose(np.log(late / early) / 10.0, growth, rtol=0.03)


def test_criteria_are_those_of_the_indicators(benchmark_draws: Made) -> None:
    """J1 to J3 of the compiled test and of the pure functions."""
    partition = quiet('benchmark_case_1', computation_delay=2e-3)
    loop = loop_of(partition, benchmark_draws(4))
    chosen = replace(compensator_of('inverse', loop), coefficients=np.array([1.0, 0.022, 1e-4]))
    test = VirtualTest(
        partition,
        loop.draws,
        loop.names,
        loop.effects,
        loop.specimen,
        chosen,
        artificial(3, 8.0).at(partition.period),
        1,
    )
    found, whole = test.run(0), test.histories(0)
    for i in range(4):
        j1, j2, j3 = TargetMotion(whole.target[i], partition.period).criteria(whole.moved[i])
        assert (found.j1[i], found.j2[i], found.j3[i]) == pytest.approx((j1, j2, j3), rel=1e-9)
    assert found.j1.min() > 1e-3


@pytest.mark.parametrize('rate', [100.0, 256.0, 1024.0, 5000.0])
def test_j1_of_fast_structures_at_slow_rates(rate: float) -> None:
    """The lag of structures of 1, 8, and of 1 and 8 Hz: a climb in long steps leaps periods."""
    rng = np.random.default_rng(0)
    period, late = 1.0 / rate, np.round(rate * np.array([0.0, 0.02, 0.04, 0.08])).astype(int)
    n, before = round(20.0 * rate), late.max()
    noise, motion = rng.standard_normal(n + before), {}
    for hertz in (1.0, 8.0):
        root = np.exp(2.0 * np.pi * hertz * period * (-0.03 + 1j))
        x = signal.lfilter([1.0], [1.0, -2.0 * root.real, abs(root) ** 2], noise)
        # At rest at both ends: no sample is in one row alone.
        motion[hertz] = x / x.std() * np.pad(np.hanning(n - before), before)
    for x in (motion[1.0], motion[8.0], motion[1.0] + 0.5 * motion[8.0]):
        target = np.tile(x[before:], (len(late), 1))
        moved = np.array([x[before - k : before - k + n] for k in late])
        for row, found in zip(moved, lags(target, moved, period), strict=True):
            assert found == round(TargetMotion(target[0], period).criteria(row).j1 * rate)
        assert lags(target, moved, period).tolist() == late.tolist()
    moved[1, 5] = np.nan
    assert np.isnan(lags(target, moved, period)).tolist() == [False, True, False, False]


@pytest.mark.parametrize('case', range(1, 5))
def test_the_benchmark_is_tracked(case: int, benchmark_draws: Made) -> None:
    """J2 at most 1 % in the median and 2 % at the 95th percentile over the plant's spread."""
    found = ag.rths(
        f'benchmark_case_{case}',
        benchmark_draws(32),
        compensator='ats',
        draws=32,
        ground_motion=artificial(case, 30.0),
    )
    assert found.virtual is not None and found.unstable_by == 'virtual test'
    assert found.p_unstable.value == 0.0
    assert found.virtual.indicators['J2'].median <= 0.01
    assert found.virtual.j2_percentile_95 is not None and found.virtual.j2_percentile_95 <= 0.02
    assert abs(found.virtual.indicators['J1_s'].median) <= 0.25e-3


@pytest.mark.slow
def test_the_robust_compensator_is_better_in_its_worst_percentile(benchmark_draws: Made) -> None:
    """Two actuators, a fifth of the draws the slower one: the inverse of the mean misses it.

    The mean lies a fifth of the way from one to the other; half of it is best in the worst case.
    """
    found = benchmark_draws(160)
    draws = np.tile(found.draws[0, 0], (40, 4, 1))
    draws[::5, :, found.names.index('beta_1')] *= 1.1
    partition = read_partition('benchmark_case_1')
    partition = replace(partition, specimen=replace(partition.specimen, stddev={}))
    worst = {}
    for kind in ('inverse', 'robust'):
        virtual = ag.rths(
            partition,
            replace(found, draws=draws),
            compensator=kind,
            draws=160,
            ground_motion=artificial(5, 10.0),
        ).virtual
        assert virtual is not None and virtual.j2_percentile_95 is not None
        worst[kind] = virtual.j2_percentile_95
    assert worst['robust'] < 0.75 * worst['inverse']


def test_nonlinear_effects_need_a_record_and_are_felt(benchmark_draws: Made) -> None:
    """Friction enters the response; without a record the loop is refused."""
    rubbed = benchmark_draws(8, ('coulomb-friction',))
    with pytest.raises(ag.InputError, match='coulomb-friction'):
        ag.rths('benchmark_case_1', rubbed, compensator='inverse')
    draws = rubbed.draws.copy()
    draws[..., -1] = 200.0  # N
    heavy = replace(rubbed, draws=draws)
    found = {
        name: ag.rths(
            'benchmark_case_1', some, compensator='inverse', ground_motion=artificial(1, 10.0)
        )
        for name, some in (('free', rubbed), ('rubbed', heavy))
    }
    free, stiff = (found[n].virtual.indicators['J2'].median for n in ('free', 'rubbed'))
    assert stiff > 2.0 * free
    costs = [found[n].effect_cost_s['coulomb-friction'].median for n in ('free', 'rubbed')]
    assert abs(costs[1]) > 2.0 * abs(costs[0])


def test_failure_is_counted(benchmark_draws: Made) -> None:
    """The share of the draws whose peaks exceed the limit, diverged ones with it."""
    motion = artificial(1, 10.0)
    posterior = benchmark_draws(64)
    plain = ag.rths('benchmark_case_1', posterior, compensator='inverse', ground_motion=motion)
    assert plain.virtual is not None
    limit = plain.virtual.indicators['peak_force_n'].median
    found = ag.rths(
        'benchmark_case_1',
        posterior,
        compensator='inverse',
        ground_motion=motion,
        criteria={'force': limit, 'drift': 1.0},
    ).virtual
    assert found is not None
    force, drift = found.failures
    assert force.probability.value == 0.5 and drift.probability.value == 0.0
    lost = ag.rths('benchmark_case_1', posterior, ground_motion=motion, criteria={'drift': 1.0})
    assert lost.virtual is not None and lost.virtual.diverged.value == 1.0
    assert lost.virtual.failures[0].probability.value == 1.0 and not lost.virtual.indicators


def test_the_same_seed_gives_the_same_test(benchmark_draws: Made, tmp_path: Path) -> None:
    """Bit by bit, however many threads; kept and read back; in the report."""
    options = {'compensator': 'ats', 'ground_motion': artificial(1, 5.0)}
    one, two = (ag.rths('benchmark_case_2', benchmark_draws(40), **options) for _ in range(2))
    assert one.virtual is not None and two.virtual is not None
    np.testing.assert_array_equal(one.virtual.upper, two.virtual.upper)
    again = ag.StabilityResult.load(one.save(tmp_path / 'kept.npz'))
    assert again.to_json() == one.to_json()
    assert 'floor' in one.report(tmp_path / 'report.html').read_text().lower()


def test_the_command_line_says_which_compensator(
    benchmark_draws: Made, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Text and JSON from the same numbers."""
    path = benchmark_draws(16).save(tmp_path / 'posterior.npz')
    record = tmp_path / 'record.csv'
    motion = artificial(1, 10.0)
    times = np.arange(len(motion.acceleration)) * motion.period
    np.savetxt(record, np.column_stack([times, motion.acceleration]), delimiter=',')
    out = tmp_path / 'out.json'
    command = [
        'rths',
        'benchmark_case_1',
        '--posterior',
        str(path),
        '--ground-motion',
        str(record),
    ]
    assert (
        main([*command, '--compensator', 'best', '--fail', 'drift=0.01', '--json', str(out)]) == 0
    )
    said, found = capsys.readouterr().out, json.loads(out.read_text())
    assert found['comparison']['use'] == 'ats' and 'use ats' in said
    assert found['virtual_test']['failures'][0]['criterion'] == 'drift'
    assert found['indicators']['J2'] == found['comparison']['compensators']['ats']['J2']
    assert main([*command, '--fail', 'drift']) == 2
    assert main([*command, '--scale', '-1']) == 2
