"""Quantisation, hum and jitter are found on what remains, and nothing is found in noise."""

import numpy as np
import pytest

from actuator_glue.diagnosis.measured import hum, measurement
from actuator_glue.diagnosis.measured.measurement import (
    find,
    grid,
    jitter,
    quantisation,
    staircase,
)
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.records import Record

RATE = 256.0
T = np.arange(int(30 * RATE)) / RATE
Y = 2e-3 * np.sin(np.pi / 3 * T**2)
SIGMA = 1e-5


def data(error: np.ndarray) -> Data:
    """One record whose model is exact."""
    return Data.whole([Record(Y, Y + error, 1 / RATE, stiffness=0.0)])


def test_noise_alone_gives_nothing() -> None:
    """Twenty records of noise; each test's false alarm rate is below 10^-4."""
    rng = np.random.default_rng(1)
    for _ in range(20):
        e = SIGMA * rng.standard_normal(len(T))
        assert find(data(e), e, 0.4 * SIGMA) == ()


def test_a_grid_is_found_with_its_step() -> None:
    """Values rounded to 50 um lie on a grid, whatever its offset."""
    rng = np.random.default_rng(2)
    y = Y + SIGMA * rng.standard_normal(len(T))
    step = 5e-5
    record = Record(Y, step * np.round(y / step) + 1.3e-5, 1 / RATE, stiffness=0.0)
    assert grid(record) == pytest.approx(step, rel=1e-6)
    found = quantisation(Data.whole([record]))
    assert found is not None
    assert found.rms == pytest.approx(step / np.sqrt(12))


def test_a_line_is_found_in_every_phase() -> None:
    """Amplitude and frequency of hum, its phase being another in each record."""
    rng = np.random.default_rng(3)
    records, errors = [], []
    for phase in (0.3, 2.0):
        e = SIGMA * rng.standard_normal(len(T)) + 2e-5 * np.sin(2 * np.pi * 50.03 * T + phase)
        records.append(Record(Y, Y + e, 1 / RATE, stiffness=0.0))
        errors.append(e)
    found = hum.find(Data.whole(records), np.concatenate(errors))
    assert found is not None
    assert found.values[2] == pytest.approx(50.03, abs=2e-3)
    assert found.rms == pytest.approx(2e-5 / np.sqrt(2), rel=0.1)


def test_a_line_is_taken_out_with_its_phase() -> None:
    """What remains is the noise; 2 % is two standard errors of its rms."""
    rng = np.random.default_rng(5)
    e = SIGMA * rng.standard_normal(len(T))
    tone = 3e-5 * np.sin(2 * np.pi * 50.0 * T + 1.1)
    seen = data(e + tone)
    found = hum.find(seen, e + tone)
    assert found is not None
    left = hum.without(seen, found).records[0].measured - Y
    assert np.std(left) == pytest.approx(SIGMA, rel=0.02)
    assert np.std(hum.regressed(seen, e + tone, found)) == pytest.approx(SIGMA, rel=0.02)


def test_harmonics_of_a_sinusoidal_command_are_no_hum() -> None:
    """The third harmonic is the response to the command, at 9 Hz under a sine of 3 Hz."""
    u = 2e-3 * np.sin(2 * np.pi * 3.0 * T)
    e = SIGMA * np.random.default_rng(6).standard_normal(len(T))
    e = e + 3e-5 * np.sin(2 * np.pi * 9.0 * T)
    record = Record(u, u + e, 1 / RATE, stiffness=0.0)
    assert hum.find(Data.whole([record]), e) is None
    assert hum.find(data(e), e) is not None


@pytest.mark.parametrize('step', [2e-5, 6e-5])
def test_a_grid_under_later_noise_is_found(step: float) -> None:
    """Noise that the amplifier adds after the converter hides the grid, not its sawtooth."""
    e = step * np.round(Y / step) - Y + SIGMA * np.random.default_rng(8).standard_normal(len(T))
    seen = data(e)
    assert grid(seen.records[0]) == 0.0
    found = staircase(seen, e, Y)
    assert found is not None
    assert found.values[0] == pytest.approx(step, rel=1e-3)


def test_jitter_is_variance_with_velocity() -> None:
    """Independent errors of the sample times; the estimate scatters by 3 %."""
    rng = np.random.default_rng(4)
    late = 5e-4
    y = 2e-3 * np.sin(np.pi / 3 * (T + late * rng.standard_normal(len(T))) ** 2)
    e = y - Y + SIGMA * rng.standard_normal(len(T))
    found = jitter(data(e), e, Y)
    assert found is not None
    assert found.values[0] == pytest.approx(late, rel=0.15)
    assert found.nats > 25.0


def test_jitter_of_a_long_record_is_found_piece_by_piece(
    monkeypatch: pytest.MonkeyPatch, rng_seed: int
) -> None:
    """The filter forgets where a piece began: the numbers are those of the whole."""
    e = SIGMA * np.random.default_rng(rng_seed).standard_normal(len(T)) * (1.0 + T)
    whole = jitter(data(e), e, Y)
    monkeypatch.setattr(measurement, '_PIECE', 500)
    pieces = jitter(data(e), e, Y)
    assert whole is not None
    assert pieces is not None
    assert pieces.values == pytest.approx(whole.values, rel=1e-9)
    assert pieces.nats == pytest.approx(whole.nats, rel=1e-9)
