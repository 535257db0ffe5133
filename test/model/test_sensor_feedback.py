"""Sensor effects inside of the loop: what they are equal to, play, noise, expressions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from effect_records import RATE, U, record

from actuator_glue.inference.least_squares.data import Data
from actuator_glue.inference.least_squares.fit import fit
from actuator_glue.model.effects.terms.entry import term
from actuator_glue.model.parameters import TABLE_2, Parameter
from actuator_glue.model.stream import Stream
from actuator_glue.model.structure import Structure

FINE = 64


def test_nothing_is_fed_back_by_default() -> None:
    """A share of zero leaves every bit."""
    r = record()
    with_it = Structure(('backlash', 'sensor-lag', 'bias', 'sensor-feedback'))
    without = Structure(with_it.effects[:-1])
    theta = [*TABLE_2, 40e-6, 2e-3, 50e-6]
    y = with_it.simulate([*theta, 0.0], r)
    # Alone, bias takes the exact path; here all three go through the compiled step.
    assert np.array_equal(y, without.simulate(theta, r))
    assert np.abs(with_it.simulate([*theta, 1.0], r) - y).max() > 10e-6


@pytest.mark.parametrize('k', [0.0, 250e3])
def test_a_bias_inside_is_a_null_offset(k: float) -> None:
    """Of the valve, the other way round, beside the bias of the record."""
    r, b = record(k), 50e-6
    y = Structure(('bias', 'sensor-feedback')).simulate([*TABLE_2, b, 1.0], r)
    same = Structure(('valve-null', 'bias')).simulate([*TABLE_2, -b, b], r)
    assert np.abs(y - same).max() < 1e-12


def test_a_lag_inside_is_a_pole_of_the_valve() -> None:
    """Third order without zeros: a record without specimen cannot tell them apart.

    One of them is stepped by the scheme: 0.15 um rms, as against scipy.
    """
    r, lag = record(0.0, 'linear'), 3e-3
    y = Structure(('sensor-lag', 'sensor-feedback')).simulate([*TABLE_2, lag, 1.0], r)
    share = 1.0 / (1.0 + TABLE_2[0] * lag)
    theta = [share * TABLE_2[0], share * TABLE_2[1], *TABLE_2[2:], share * lag]
    same = Structure(('valve-lag',)).simulate(theta, r)
    assert np.sqrt(np.mean((y - same) ** 2)) < 0.15e-6
    outside = Structure(('sensor-lag',)).simulate([*TABLE_2, lag], r)
    assert np.abs(y - outside).max() > 50e-6


def played(half: float, k: float, inside: float) -> np.ndarray:
    """Record behind play, by Heun's rule with 64 steps a sample; a linear command."""
    b1, n0, a2, a3 = TABLE_2
    u, h = U[: round(1.6 * RATE)], 1.0 / RATE / FINE
    q = x = y = 0.0
    out = np.zeros(len(u))
    at = (np.arange((len(u) - 1) * FINE) + 0.5) / FINE
    for i, command in enumerate(np.interp(at, np.arange(len(u)), u)):
        middle = x + 0.5 * h * (q - a3 * k * x) / (a2 + k)
        shown = min(max(y, middle - half), middle + half)
        e = command - middle - inside * (shown - middle)
        q_new = q + h * (n0 * e - b1 * (q + 0.5 * h * (n0 * e - b1 * q)))
        x += h * (0.5 * (q + q_new) - a3 * k * middle) / (a2 + k)
        q, y = q_new, min(max(y, x - half), x + half)
        if (i + 1) % FINE == 0:
            out[(i + 1) // FINE] = y
    return out


@pytest.mark.parametrize('inside', [0.5, 1.0])
def test_play_inside(inside: float) -> None:
    """Below 0.15 um rms and 1 um at any sample of a 2 mm sweep up to 10 Hz."""
    r = record(250e3, 'linear').slice(0, round(1.6 * RATE))
    y = Structure(('backlash', 'sensor-feedback')).simulate([*TABLE_2, 40e-6, inside], r)
    outside = Structure(('backlash',)).simulate([*TABLE_2, 40e-6], r)
    assert np.abs(y - outside).max() > 5e-6
    difference = 1e6 * (y - played(40e-6, 250e3, inside))
    assert np.sqrt(np.mean(difference**2)) < 0.15
    assert np.abs(difference).max() < 1.0


def test_an_expression_inside_is_that_of_the_record() -> None:
    """One's own expression of the sensor is fed back as the catalogue's bias is."""
    r = record()
    own = term('own-bias', 'sensor: y = y + own', (Parameter('own', 'm', -1.0, 1.0, '', 0.0),))
    y = Structure((own, 'sensor-feedback')).simulate([*TABLE_2, 50e-6, 1.0], r)
    same = Structure(('bias', 'sensor-feedback')).simulate([*TABLE_2, 50e-6, 1.0], r)
    assert np.array_equal(y, same)


def test_noise_inside() -> None:
    """The piston follows the command less what the record showed too much; in any blocks."""
    structure, noise, count = Structure(('sensor-feedback',)), 20e-6, 1000
    options = {'stiffness': 250e3, 'period': 1.0 / RATE, 'noise_stddev': noise}
    first, second = (
        Stream(structure, [*TABLE_2, 1.0], rng=np.random.default_rng(7), **options)
        for _ in range(2)
    )
    measured = first.step(U[:count])[0]
    parts = [second.step(part)[0] for part in np.split(U[:count], [1, 2, 300, 300, 777])]
    assert np.array_equal(np.concatenate(parts), measured)
    shown = noise * np.random.default_rng(7).standard_normal((count, 2))[:, 1]
    plain = Stream(Structure(()), TABLE_2, stiffness=250e3, period=1.0 / RATE)
    moved = plain.step(U[:count] - shown)[0]
    quiet = Stream(Structure(()), TABLE_2, stiffness=250e3, period=1.0 / RATE).step(U[:count])[0]
    assert np.std(moved - quiet) > 1e-6
    assert np.abs(measured - shown - moved).max() < 0.02 * np.std(moved - quiet)


@pytest.mark.parametrize('inside', [0.0, 1.0])
def test_a_fit_tells_play_inside_from_outside(inside: float, rng_seed: int) -> None:
    """Within five standard deviations of the truth, in 1 of 10^6 runs by chance."""
    structure, noise = Structure(('backlash', 'sensor-feedback')), 5e-6
    r = record(250e3, 'linear')
    y = structure.simulate([*TABLE_2, 40e-6, inside], r)
    y += noise * np.random.default_rng(rng_seed).standard_normal(len(y))
    data = Data.whole([replace(r, measured=y)])
    found = fit(data, structure, np.array([*TABLE_2, 20e-6, 0.5]))
    curvature = found.jacobian @ found.jacobian.T / found.rms**2
    spread = np.sqrt(np.linalg.inv(curvature)[-1, -1])
    assert spread < 0.1
    assert abs(found.theta[-1] - inside) < 5.0 * spread
