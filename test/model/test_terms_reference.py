"""Effects of the catalogue that are expressions, against plain integration of their equations."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from actuator_glue.model.commands import sweep
from actuator_glue.model.effects import CATALOGUE
from actuator_glue.model.effects.terms.definition import entries, mapping
from actuator_glue.model.parameters import TABLE_2
from actuator_glue.model.structure import Structure
from actuator_glue.records import Record

RATE, FINE, K = 256.0, 64, 250e3
U = sweep(RATE, duration=1.6, f0=0.0, f1=10.0, amplitude=2e-3)

# What a step of h [s] makes of a signal, given what was remembered: (value, memory, size, h).
Operator = Callable[[float, float, float, float], tuple[float, float]]


def nothing(value: float, memory: float, size: float, h: float) -> tuple[float, float]:
    """Leave the signal."""
    return value, memory


def lag(u: float, before: float, size: float, h: float) -> tuple[float, float]:
    """First-order lag, exact for a held value."""
    after = u + (before - u) * np.exp(-h / size)
    return 0.5 * (before + after), after


def rate(u: float, before: float, size: float, h: float) -> tuple[float, float]:
    """Never faster than 1/size."""
    after = before + min(max(u - before, -h / size), h / size)
    return after, after


def integral(e: float, before: float, size: float, h: float) -> tuple[float, float]:
    """Proportional and integral."""
    after = before + h * e
    return e + 0.5 * size * (before + after), after


def play(e: float, before: float, size: float, h: float) -> tuple[float, float]:
    """Play operator."""
    after = min(max(before, e - size), e + size)
    return after, after


def integrated(command: Operator, valve: Operator, size: float) -> np.ndarray:
    """Displacement by Heun's rule with 64 steps a sample, command linear between samples."""
    b1, n0, a2, a3 = TABLE_2
    h = 1.0 / RATE / FINE
    q = x = front = back = 0.0
    out = np.zeros(len(U))
    at = (np.arange((len(U) - 1) * FINE) + 0.5) / FINE
    for i, u in enumerate(np.interp(at, np.arange(len(U)), U)):
        u_c, front = command(u, front, size, h)
        middle = x + 0.5 * h * (q - a3 * K * x) / (a2 + K)
        e, back = valve(u_c - middle, back, size, h)
        q_new = q + h * (n0 * e - b1 * (q + 0.5 * h * (n0 * e - b1 * q)))
        x += h * (0.5 * (q + q_new) - a3 * K * middle) / (a2 + K)
        q = q_new
        if (i + 1) % FINE == 0:
            out[(i + 1) // FINE] = x
    return out


CASES = [
    ('command-lag', 2e-3, lag, nothing, 1),
    ('command-lag', 10e-3, lag, nothing, 1),
    # Limiting begins inside of a step, which an expression does not see: 0.6 um rms, 2.8 um at
    # most with the usual steps.
    ('command-rate', 1 / 0.06, rate, nothing, 4),
    ('integral-action', 3.0, nothing, integral, 1),
    ('valve-hysteresis', 30e-6, nothing, play, 1),
]


@pytest.mark.parametrize(('name', 'size', 'command', 'valve', 'finer'), CASES)
def test_in_the_loop(
    name: str, size: float, command: Operator, valve: Operator, finer: int
) -> None:
    """Below 0.15 um rms and 0.6 um at any sample of a 2 mm sweep up to 10 Hz."""
    record = Record(U, U, 1 / RATE, K, hold='linear')
    y = Structure((name,)).simulate([*TABLE_2, size], record, rate=finer)
    plain = Structure(()).simulate(TABLE_2, record)
    off = integrated(nothing, nothing, size)
    assert 1e6 * np.abs(off - plain).max() < 0.05, 'the reference itself'
    assert np.abs(y - plain).max() > 5e-6, 'the case must show the effect'
    difference = 1e6 * (y - integrated(command, valve, size))
    assert np.sqrt(np.mean(difference**2)) < 0.15
    assert np.abs(difference).max() < 0.6


def test_sensor_curve() -> None:
    """Exactly what its equation says."""
    record = Record(U, U, 1 / RATE, K)
    plain = Structure(()).simulate(TABLE_2, record)
    y = Structure(('sensor-curve',)).simulate([*TABLE_2, 10.0, 8e3], record)
    assert np.abs(y - (plain + 10.0 * plain**2 + 8e3 * plain**3)).max() < 1e-12


def test_they_pass_the_checks_of_ones_own() -> None:
    """Which the catalogue saves itself when it is imported."""
    written = [e for e in CATALOGUE.values() if e.expression is not None]
    assert {e.name for e in written} >= {name for name, *_ in CASES}
    for effect in written:
        assert entries(mapping([effect]))[0].equation == effect.equation
