"""Hum is a line in true time, whichever samples count."""

from dataclasses import replace

import numpy as np
import pytest

from actuator_glue.api.simulation import Command, Sensors, simulate
from actuator_glue.diagnosis.diagnose import diagnose
from actuator_glue.diagnosis.measured import hum
from actuator_glue.diagnosis.samples.preparation import prepare
from actuator_glue.diagnosis.thresholds import Thresholds
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.model.structure import Structure
from actuator_glue.records import Record

RATE = 256.0
THETA = np.array([134.0, 1.1e9, 2.5e5, 0.5])
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


@pytest.mark.parametrize('amplitude', [0.0, 10e-6])
@pytest.mark.parametrize('first', [0.6, 1.0])
@pytest.mark.parametrize('effect', ['coulomb-friction', 'backlash'])
def test_repeated_sweeps_have_no_hum_of_their_own(
    effect: str, first: float, amplitude: float
) -> None:
    """Their response has lines, as many as sweeps fit into a second; hum is one.

    Sweeps that grow, or all alike: then one of the friction's lines stood out from what a tenth of
    all bins exceed by 33 times (hum by 18); from the other lines none does by 4.
    """
    t = np.arange(int(6 * RATE)) / RATE
    sweep = 2e-3 * np.sin(np.pi * (8.0 / 6.0) * t**2)
    command = np.concatenate([scale * sweep for scale in np.linspace(first, 1.0, 20)])
    structure = Structure((effect,))
    theta = np.array([*THETA, 600.0 if effect == 'coulomb-friction' else 2e-4])
    bare = Record(command, np.zeros(len(command)), 1 / RATE, stiffness=250e3)
    line = amplitude * np.sin(2 * np.pi * 50.03 * bare.time + 1.0)
    noise = 1e-6 * np.random.default_rng(3).standard_normal(len(bare))
    measured = structure.simulate(theta, bare) + line + noise
    data = prepare([replace(bare, measured=measured)], []).fit
    error = data.target - data.simulate(Structure(()), THETA)[0]
    found = hum.find(data, error)
    assert (found is not None) == bool(amplitude)
    assert found is None or found.frequency == pytest.approx(50.03, abs=0.01)


@pytest.mark.parametrize('hertz', [0.0, 50.0])
def test_no_harmonic_of_a_sinusoidal_test_is_hum(hertz: float, rng_seed: int) -> None:
    """Friction answers it with lines of every odd order; hum between them is found."""
    rng = np.random.default_rng(rng_seed)
    # Its 29th and 30th harmonics are 0.25 Hz and more from 50 Hz.
    own = float(rng.uniform(1.675, 1.715))
    command = 2e-3 * np.sin(2 * np.pi * own * T)
    error = 3e-6 * rng.standard_normal(len(T)) + 4e-6 * np.sin(2 * np.pi * hertz * T)
    error += sum(6e-6 / n**0.5 * np.sin(2 * np.pi * n * own * T + n) for n in range(1, 60, 2))
    data = Data.whole([Record(command, command + error, 1 / RATE, stiffness=250e3)])
    line = hum.find(data, error)
    assert (line.frequency if line else 0.0) == pytest.approx(hertz, abs=0.01)


@pytest.mark.slow
@pytest.mark.parametrize(('command', 'amplitude'), [(0, 12e-6), (1, 0.0)])
def test_a_line_of_the_missing_effect_is_no_hum(
    command: int, amplitude: float, rng_seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Integral action under a random command leaves peaks in the residual of Eq. (2).

    Without hum the largest is taken for it at first, here; it must go beside what is found.
    Hum beside it is told all the same: its evidence is against what integral action leaves.
    """
    rng = np.random.default_rng(rng_seed)
    t = np.arange(int(30 * RATE)) / RATE
    steps = np.resize(np.repeat(np.linspace(0.3, 5.0, 8), len(t) // 8), len(t))
    stepped = 5e-3 * np.sin(2 * np.pi * np.cumsum(steps) / RATE)
    records = []
    for u in (
        Command('noise', RATE, 30.0, 5e-3, high=5.0, seed=command),
        Record(stepped, stepped, 1 / RATE),
        Command('sweep', RATE, 30.0, 5e-3, high=4.5),
    ):
        moved = simulate(
            u,
            stiffness=7.5e3,
            theta=[85.0, 6.3e7, 7.5e4, 1.8],
            effects={'integral-action': {'integral_rate': 1.4}},
            sensors=Sensors(noise=8e-6),
            seed=(rng_seed, len(records)),
        )
        line = amplitude * np.sin(2 * np.pi * 50.0 * moved.time + rng.uniform(0.0, 6.28))
        records.append(replace(moved, measured=moved.measured + line))
    look, seen = hum.find, []

    def taken_in(data: Data, errors: np.ndarray) -> hum.Line | None:
        clear = -1.0 if not (seen or amplitude) else hum._CLEAR
        with monkeypatch.context() as changed:
            changed.setattr(hum, '_CLEAR', clear)
            seen.append(look(data, errors))
        return seen[-1]

    monkeypatch.setattr(hum, 'find', taken_in)
    found = diagnose(records[:2], records[2], settings=Thresholds(evaluations=0))
    assert seen[0] is not None
    names = {e.name for e in found.effects}
    assert names == ({'integral-action', 'hum'} if amplitude else {'integral-action'})
