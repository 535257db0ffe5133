"""Reports from a process beside: the same numbers, and none lost when the process dies."""

import os
import signal
from dataclasses import asdict, replace

import numpy as np
import pytest

from actuator_glue.model import commands, linear
from actuator_glue.online.job import WindowResult
from actuator_glue.online.playback import replay, stream
from actuator_glue.online.settings import EstimatorSettings
from actuator_glue.records import Record
from actuator_glue.workers.reports import Reports

RATE = 200.0
SETTINGS = EstimatorSettings(
    window=2.0, hop=0.5, settle=0.3, time_budget=0.5, evaluations=4000, start_evaluations=12_000
)

needs_two_cores = pytest.mark.skipif(
    len(os.sched_getaffinity(0)) < 2, reason='one core: reports are computed in this process'
)


@pytest.fixture(scope='module')
def record() -> Record:
    """Response of Eq. (2) with sensor noise; a still stretch gives windows that fail."""
    command = commands.noise(RATE, 8.0, 0.2, 8.0, seed=5)
    command[700:1200] = command[700]
    theta = np.array([134.0, 1.1e9, 2.5e5, 0.5])
    clean = linear.simulate(theta, command, stiffness=250e3, period=1.0 / RATE)
    measured = clean + 1e-5 * np.random.default_rng(6).standard_normal(len(clean))
    return Record(command, measured, 1.0 / RATE, 250e3, start_ns=10**18)


@pytest.fixture(scope='module')
def alone(record: Record) -> list[object]:
    """What a replay in one process tells."""
    found = list(replay(stream(record), SETTINGS))
    assert any(isinstance(r, WindowResult) and r.scored for r in found)
    assert not all(isinstance(r, WindowResult) for r in found)
    return found


def same(one: object, other: object) -> bool:
    """Whether results or events are equal to the bit, arrays and dataclasses inside included."""
    if isinstance(one, np.ndarray):
        return np.array_equal(one, other, equal_nan=one.dtype.kind == 'f')
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(same(one[k], other[k]) for k in one)
    if isinstance(one, (list, tuple)):
        return len(one) == len(other) and all(map(same, one, other))
    return one == other or (one != one and other != other)


@needs_two_cores
def test_the_bits_are_those_of_one_process(record: Record, alone: list[object]) -> None:
    with Reports() as reports:
        assert reports.wait(120.0)
        found = list(replay(stream(record), SETTINGS, reports=reports))
    assert all(
        type(a) is type(b) and same(asdict(a), asdict(b))
        for a, b in zip(found, alone, strict=True)
    )


@needs_two_cores
@pytest.mark.parametrize('after', [0, 9])
def test_nothing_is_lost_when_the_process_dies(
    record: Record, alone: list[object], after: int
) -> None:
    with Reports() as reports:
        assert reports.wait(120.0)
        killed = False

        def deadly(found):
            nonlocal killed
            for thing in found:
                if isinstance(thing, tuple) and thing[0].window.number >= after and not killed:
                    os.kill(reports._worker._process.pid, signal.SIGKILL)
                    killed = True
                yield thing

        found = list(replay(stream(record), SETTINGS, reports=lambda f: reports(deadly(f))))
    assert killed
    assert all(same(asdict(a), asdict(b)) for a, b in zip(found, alone, strict=True))


def test_until_the_process_is_ready_reports_are_computed_here(
    record: Record, alone: list[object]
) -> None:
    with Reports() as reports:
        found = list(replay(stream(record), SETTINGS, reports=reports))
    assert all(same(asdict(a), asdict(b)) for a, b in zip(found, alone, strict=True))


@pytest.mark.slow
@pytest.mark.parametrize('beside', [pytest.param(True, marks=needs_two_cores), False])
def test_without_limits_all_else_is_there(
    record: Record, alone: list[object], beside: bool
) -> None:
    with Reports(limits=False) as reports:
        assert not beside or reports.wait(120.0)
        found = list(replay(stream(record), SETTINGS, reports=reports))
    scored = 0
    for ours, whole in zip(found, alone, strict=True):
        if isinstance(ours, WindowResult) and isinstance(whole, WindowResult):
            for short, long in zip(ours.scored, whole.scored, strict=True):
                assert not len(short.band) and len(long.band)
                assert np.array_equal(short.coverage, long.coverage)
                assert np.array_equal(short.width, long.width)
                scored += 1
            ours, whole = (replace(r, scored=(), response=None) for r in (ours, whole))
        assert same(asdict(ours), asdict(whole))
    assert scored
