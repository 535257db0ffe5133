"""Each effect of the catalogue leaves the trace it says it leaves."""

from __future__ import annotations

import numpy as np
import pytest

from actuator_glue.model.effects.catalogue.stribeck_friction import bell
from actuator_glue.model.parameters import TABLE_2
from actuator_glue.model.structure import Structure
from actuator_glue.records import Record

RATE = 500.0
K = 250e3


def response(
    effect: str, values: list[float], u: np.ndarray, stiffness: float = K
) -> tuple[np.ndarray, np.ndarray]:
    """Return Eq. (2)'s displacement and what the effect adds to it [m]."""
    record = Record(u, u, 1.0 / RATE, stiffness)
    base = Structure(()).simulate(TABLE_2, record)
    return base, Structure((effect,)).simulate([*TABLE_2, *values], record) - base


def sine(hz: float, amplitude: float = 2e-3, seconds: float = 8.0) -> np.ndarray:
    """Return a sine command that starts smoothly; the last four seconds are steady."""
    t = np.arange(round(seconds * RATE)) / RATE
    return amplitude * np.minimum(t, 1.0) * np.sin(2.0 * np.pi * hz * t)


def harmonics(trace: np.ndarray, hz: float) -> np.ndarray:
    """Amplitudes of harmonics 0..5 over the last four seconds."""
    part = trace[-round(4.0 * RATE) :]
    t = np.arange(len(part)) / RATE
    lines = np.exp(-2j * np.pi * hz * np.outer(np.arange(6), t))
    return np.abs(lines @ part) * 2.0 / len(part) / np.array([2, 1, 1, 1, 1, 1])


def rms(trace: np.ndarray) -> float:
    """Rms over the steady part."""
    return float(np.sqrt(np.mean(trace[-round(4.0 * RATE) :] ** 2)))


@pytest.mark.parametrize(
    ('effect', 'values'),
    [
        ('valve-deadband', [40e-6]),
        ('flow-saturation', [0.02]),
        ('pressure-flow', [1e-3]),
        ('coulomb-friction', [10.0]),
        ('stribeck-friction', [10.0, 1.5, 0.01]),
        ('backlash', [40e-6]),
        ('specimen-gap', [0.3e-3]),
        ('specimen-hardening', [1e5]),
        ('specimen-yield', [0.2, 0.7e-3, 1.0]),
    ],
)
def test_symmetric_effects_make_odd_harmonics(effect: str, values: list[float]) -> None:
    """Third harmonic, no second and no mean."""
    _, trace = response(effect, values, sine(2.0))
    found = harmonics(trace, 2.0)
    assert found[3] > 1e-6
    assert found[3] > 50.0 * max(found[2], found[0])


def test_asymmetry_makes_even_harmonics() -> None:
    """Mean and second harmonic, hardly a third."""
    found = harmonics(response('flow-asymmetry', [0.1], sine(2.0))[1], 2.0)
    assert min(found[0], found[2]) > 5e-6
    assert min(found[0], found[2]) > 5.0 * found[3]


@pytest.mark.parametrize(
    ('effect', 'values'),
    [
        ('delay', [3e-3]),
        ('gain', [1.05]),
        ('valve-lag', [2e-3]),
        ('viscous-damping', [500.0]),
        ('payload-inertia', [10.0, 60.0]),
        ('sensor-lag', [2e-3]),
    ],
)
def test_linear_effects_scale_and_stay_at_the_fundamental(
    effect: str, values: list[float]
) -> None:
    """Twice the amplitude, twice the trace; no harmonics."""
    _, small = response(effect, values, sine(5.0, 1e-3))
    _, large = response(effect, values, sine(5.0, 2e-3))
    assert np.allclose(large, 2.0 * small, atol=1e-12)
    found = harmonics(large, 5.0)
    assert found[1] > 1e-5 and found[1] > 1e4 * found[[0, 2, 3, 4, 5]].max()


@pytest.mark.parametrize(
    ('effect', 'values', 'power'),
    [
        ('valve-deadband', [20e-6], 0.0),
        ('coulomb-friction', [5.0], 0.0),
        ('backlash', [20e-6], 0.0),
        ('specimen-hardening', [2e4], 3.0),
        ('flow-asymmetry', [0.03], 1.0),
    ],
)
def test_growth_with_amplitude(effect: str, values: list[float], power: float) -> None:
    """Absolute trace ~ A^power: relative ~ A^-1 for lost motion, A^2 for a cubic spring."""
    half, full = (rms(response(effect, values, sine(2.0, a))[1]) for a in (1e-3, 2e-3))
    assert np.log2(full / half) == pytest.approx(power, abs=0.12)


def test_play_is_a_rectangular_loop() -> None:
    """Behind by half the play in either direction, flat after a reversal."""
    b = 40e-6
    base, trace = response('backlash', [b], sine(1.0))
    steady = slice(-round(4 * RATE), None)
    speed = np.gradient(base)[steady]
    fast = np.abs(speed) > 0.5 * np.abs(speed).max()
    assert np.allclose(trace[steady][fast], -b * np.sign(speed[fast]), atol=1e-9)
    shown = (base + trace)[steady]
    assert np.mean(np.diff(shown) == 0.0) > 0.05


def test_dry_friction_sticks_at_reversals() -> None:
    """The piston stands still exactly while the force turns over."""
    base, trace = response('coulomb-friction', [20.0], sine(1.0))
    record = Record(sine(1.0), sine(1.0), 1.0 / RATE, K)
    moving = np.diff((base + trace)[-round(4 * RATE) :])
    assert 0.01 < np.mean(np.abs(moving) < 1e-9) < 0.3
    # Sliding without reversal is not slowed beyond what leakage lets through.
    ramp = np.linspace(0.0, 2e-3, len(record))
    _, late = response('coulomb-friction', [20.0], ramp, stiffness=0.0)
    assert np.ptp(late[-1000:]) < 1e-8


@pytest.mark.parametrize(
    ('effect', 'values'),
    [
        ('pressure-flow', [1e-3]),
        ('specimen-gap', [0.3e-3]),
        ('specimen-hardening', [1e5]),
        ('specimen-yield', [0.2, 0.7e-3, 1.0]),
    ],
)
def test_without_a_specimen_there_is_no_trace(effect: str, values: list[float]) -> None:
    """Nothing but rounding at k = 0."""
    assert np.abs(response(effect, values, sine(2.0), stiffness=0.0)[1]).max() < 1e-12


def test_offsets_lines_and_trends() -> None:
    """What sensor effects add is exactly what their equations say."""
    u = sine(2.0)
    t = np.arange(len(u)) / RATE
    assert np.allclose(response('bias', [3e-5], u)[1], 3e-5)
    assert np.allclose(response('drift', [2e-6], u)[1], 2e-6 * t)
    line = 3e-6 * np.cos(100 * np.pi * t) + 4e-6 * np.sin(100 * np.pi * t)
    assert np.allclose(response('hum', [3e-6, 4e-6, 50.0], u)[1], line, atol=1e-15)
    free = response('valve-null', [5e-5], u, stiffness=0.0)[1]
    assert np.allclose(free[-100:], 5e-5, rtol=1e-6)
    held = response('valve-null', [5e-5], u)[1][-1]
    gain = TABLE_2[1] / (TABLE_2[1] + TABLE_2[0] * TABLE_2[3] * K)
    assert held == pytest.approx(5e-5 * gain, rel=1e-4)


def test_time_shifts() -> None:
    """A delay of whole samples is a shift; a skew lags by eps t at time t."""
    u = sine(3.0, seconds=20.0)
    base, trace = response('delay', [5.0 / RATE], u)
    assert np.allclose((base + trace)[5:], base[:-5], atol=1e-14)
    base, trace = response('clock-skew', [1e-4], u)
    velocity = np.gradient(base, 1.0 / RATE)
    t = np.arange(len(u)) / RATE
    for begin, end in ((4.0, 8.0), (16.0, 20.0)):
        part = slice(round(begin * RATE), round(end * RATE))
        lag = -np.dot(trace[part], velocity[part]) / np.dot(velocity[part], velocity[part])
        assert lag == pytest.approx(1e-4 * t[part].mean(), rel=0.02)


def test_flow_gain_in_time() -> None:
    """gain-drift grows with time, supply-droop follows the flow and recovers."""
    u = sine(5.0, seconds=16.0)
    _, trace = response('gain-drift', [2e-3], u)
    second, last = (np.std(trace[round(s * RATE) : round((s + 2) * RATE)]) for s in (4.0, 14.0))
    assert last / second == pytest.approx(15.0 / 5.0, rel=0.1)
    t = np.arange(len(u)) / RATE
    burst = u * np.where((t > 4.0) & (t < 8.0), 1.0, 0.05)
    base, trace = response('supply-droop', [3.0, 0.5], burst)
    relative = [
        np.std(trace[a:b]) / np.std(base[a:b])
        for a, b in ((3.0, 3.9), (7.0, 7.9), (8.2, 9.2), (14.0, 15.9))
        for a, b in [(round(a * RATE), round(b * RATE))]
    ]
    assert relative[1] > 5.0 * relative[0]
    assert relative[1] > relative[2] > 2.0 * relative[3]


def test_a_mass_resonates_on_the_oil_column() -> None:
    """The trace of a payload is largest near sqrt((alpha_2 + k)/m)."""
    hz = 30.0
    mass = (TABLE_2[2] + K) / (2.0 * np.pi * hz) ** 2
    gain = {
        f: rms(response('payload-inertia', [mass, 40.0], sine(f, 1e-4))[1])
        / rms(response('gain', [2.0], sine(f, 1e-4))[1])
        for f in (5.0, 30.0, 80.0)
    }
    assert gain[30.0] > 2.0 * max(gain[5.0], gain[80.0])


def test_yielding_dissipates() -> None:
    """The force loop of the specimen has an area that grows with the amplitude."""
    from actuator_glue.model.stream import Stream

    areas = []
    for amplitude in (1e-3, 2e-3):
        stream = Stream(
            Structure(('specimen-yield',)),
            [*TABLE_2, 0.2, 0.7e-3, 1.0],
            stiffness=K,
            period=1.0 / RATE,
        )
        x, f = (column[-round(4 * RATE) :] for column in stream.step(sine(2.0, amplitude)))
        areas.append(np.trapezoid(f, x) / 8.0)  # eight cycles
    assert areas[0] > 1e-3 and areas[1] > 3.0 * areas[0]


def test_bell_of_falling_friction() -> None:
    """The polynomial stands for the exponential, and keeps what is not a number."""
    square = np.concatenate([np.linspace(0.0, 80.0, 20_001), [1e3, np.inf]])
    found = np.array([bell(s) for s in square])
    np.testing.assert_allclose(found, np.exp(-0.5 * square), rtol=0.0, atol=2e-7)
    assert np.isnan(bell(np.nan))
