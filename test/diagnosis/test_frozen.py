"""Readings that repeat: a channel that froze is bridged and told."""

from dataclasses import replace

import numpy as np
import pytest

from actuator_glue.diagnosis.samples.preparation import prepare
from actuator_glue.hygiene.frozen import lines
from actuator_glue.hygiene.impulse_removal import despiked
from actuator_glue.inference.least_squares.fit import base_fit
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array, Record

THETA = np.array([235.0, 5.0e10, 4.23e6, 3.3])
NOISE = 3e-6


def machine(
    rate: float, seed: int, effects: tuple[str, ...] = (), *own: float
) -> tuple[Record, Array]:
    """Return a record of 24 s of sweep to 10 Hz and its noise-free response."""
    t = np.arange(int(24 * rate)) / rate
    command = 2e-3 * np.sin(np.pi * (10.0 / 24.0) * t**2)
    bare = Record(command, np.zeros(len(t)), 1 / rate, stiffness=250e3)
    x = Structure(effects).simulate(np.array([*THETA, *own]), bare)
    noise = NOISE * np.random.default_rng(seed).standard_normal(len(t))
    return replace(bare, measured=x + noise), x


@pytest.mark.parametrize('rate', [500.0, 4000.0])
@pytest.mark.parametrize(
    ('filled', 'what', 'kind'),
    [(False, 'stands still', 'frozen'), (True, 'runs on a straight line', 'filled in')],
)
def test_readings_that_nobody_measured_are_bridged_and_told(
    filled: bool, what: str, kind: str, rate: float
) -> None:
    """A channel that froze, and gaps that somebody filled with lines."""
    record, x = machine(rate, 1)
    y, rng = record.measured.copy(), np.random.default_rng(5)
    starts = 6.0 + 2.0 * np.arange(8) + rng.uniform(0.0, 1.0, 8)
    lengths = rng.uniform(0.02, 0.3, 8)
    places = zip((starts * rate).astype(int), (lengths * rate).astype(int), strict=True)
    for at, size in places:
        y[at : at + size] = np.linspace(y[at], y[at + size], size, False) if filled else y[at]
    given = replace(record, measured=y)
    prepared = prepare([given], [])
    note = next(n for n in prepared.notes if kind in n)
    assert what in note
    healthy = prepare([record], [])
    bent, found = base_fit(healthy.fit).theta, base_fit(prepared.fit).theta
    assert found[0] == pytest.approx(bent[0], rel=0.005)
    kept = prepared.fit.records[0].measured - healthy.fit.records[0].measured
    assert np.abs(kept).max() < 30e-6
    clean, notes, _ = despiked([given], ['rest'])
    assert any(kind in n for n in notes)
    assert np.abs(clean[0].measured - x).max() < 40e-6


@pytest.mark.parametrize(
    ('effects', 'own'),
    [((), ()), (('backlash',), (2e-4,)), (('stribeck-friction',), (3000.0, 1.5, 0.01))],
)
@pytest.mark.parametrize('grid', [0.0, 2e-5])
def test_a_piston_that_stands_still_is_no_frozen_channel(
    effects: tuple[str, ...], own: tuple[float, ...], grid: float
) -> None:
    """Without noise play repeats a reading exactly, and so does a coarse grid."""
    _, x = machine(1000.0, 2, effects, *own)
    y = np.round(x / grid) * grid if grid else x
    record = replace(machine(1000.0, 2)[0], measured=y)
    assert not any('frozen' in n or 'filled' in n for n in prepare([record], []).notes)


@pytest.mark.parametrize(('every', 'grid'), [(5, 0.0), (10, 1e-6), (1, 50e-6)])
def test_a_channel_that_usually_runs_straight_has_no_gap(every: int, grid: float) -> None:
    """Drawn between slower readings, or coarse, it was told of as filled in here and there."""
    record, _ = machine(500.0, 2)
    y = np.round(record.measured / grid) * grid if grid else record.measured
    y = np.interp(record.time, record.time[::every], y[::every])
    assert not len(lines(y).first)
    gap = record.measured.copy()
    gap[5000:5040] = np.linspace(gap[5000], gap[5040], 40, endpoint=False)
    assert len(lines(gap).first) == 1


def slower(y: Array, way: str) -> Array:
    """Return a channel that came from a slower recorder, every tenth sample or so."""
    rng, n = np.random.default_rng(3), len(y)
    at = np.arange(0, n - 12, 10)
    if way == 'late':  # each reading is held until the next, which comes when it comes
        at = np.maximum.accumulate(np.maximum(at + rng.integers(-4, 5, len(at)), 0))
        return y[at][np.searchsorted(at, np.arange(n), side='right') - 1]
    return np.interp(np.arange(n), at, y[at])  # behind the last one it is held


@pytest.mark.parametrize('way', ['late', 'lines'])
@pytest.mark.parametrize('grid', [0.0, 4e-6])
def test_readings_that_usually_stand_are_not_frozen(way: str, grid: float) -> None:
    """Nor is what is behind the last of them; one that stands ten times as long is."""
    record, _ = machine(500.0, 4)
    y = slower(record.measured, way)
    y = np.round(y / grid) * grid if grid else y
    _, notes, _ = despiked([replace(record, measured=y)], ['rest'])
    assert not any('frozen' in n or 'filled' in n for n in notes)
    y[6030:6150] = y[6030]
    _, notes, _ = despiked([replace(record, measured=y)], ['rest'])
    assert any('1 time while the piston must move' in n for n in notes)


@pytest.mark.parametrize('rate', [100.0, 1000.0])
@pytest.mark.parametrize(
    'friction', [('coulomb-friction', 2000.0), ('stribeck-friction', 3e3, 1.5, 0.01)]
)
def test_a_piston_that_friction_holds_starts_where_it_stood(
    rate: float, friction: tuple[str, float]
) -> None:
    """It sticks under slow ramps, while Eq. (2) goes on; a frozen channel jumps at its end."""
    t = np.arange(int(30 * rate)) / rate
    command = np.interp(
        t, [1, 4, 6, 9, 12, 18, 20, 26], 5e-3 * np.array([0, 1, 1, -1, -1, 1, 1, 0])
    )
    bare = Record(command, np.zeros(len(t)), 1 / rate, stiffness=250e3)
    name, *own = friction
    x = Structure((name,)).simulate(np.array([*THETA, *own]), bare)
    for grid in (1e-12, 1e-6):
        y = np.round(x / grid) * grid
        _, notes, _ = despiked([replace(bare, measured=y)], ['rest'])
        assert not any('frozen' in n or 'filled' in n for n in notes)
        y[int(14 * rate) : int(16 * rate)] = y[int(14 * rate)]
        _, notes, _ = despiked([replace(bare, measured=y)], ['rest'])
        assert any('frozen' in n for n in notes)
