"""Hum is a line in true time, whichever samples count."""

import numpy as np
import pytest

from actuator_glue.diagnosis import hum
from actuator_glue.diagnosis.data import Data
from actuator_glue.diagnosis.preparation import prepare
from actuator_glue.records import Record

RATE = 256.0
T = np.arange(int(48 * RATE)) / RATE
SWEEP = 2e-3 * np.sin(np.pi * (8.0 / 48.0) * T**2)


def residual(frequency: float, amplitude: float, seed: int) -> tuple[Data, np.ndarray]:
    """Return the fitting part of one record in folds and a residual of noise and a line."""
    rng = np.random.default_rng(seed)
    noise = 3e-6 * rng.standard_normal(len(T))
    line = amplitude * np.sin(2 * np.pi * frequency * T + rng.uniform(0, 6.28))
    record = Record(SWEEP, SWEEP + noise + line, 1 / RATE, stiffness=250e3)
    data = prepare([record], []).fit
    return data, (noise + line)[data.masks[0]]


@pytest.mark.parametrize('frequency', [49.95, 50.0, 50.05, 50.1, 59.9])
def test_a_line_between_held_out_blocks_is_found(frequency: float) -> None:
    """At any phase from block to block."""
    line = hum.find(*residual(frequency, 10e-6, 1))
    assert line is not None
    assert line.frequency == pytest.approx(frequency, abs=2e-3)
    assert line.rms == pytest.approx(10e-6 / np.sqrt(2), rel=0.03)


@pytest.mark.parametrize('seed', range(8))
def test_noise_has_no_line(seed: int) -> None:
    """Nor do gaps make one; the threshold is exceeded in one of 10^6 records."""
    assert hum.find(*residual(50.0, 0.0, seed)) is None
