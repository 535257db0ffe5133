"""What a fitted model leaves: noise, or structure that its intervals know nothing of."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from actuator_glue.api.simulation import Command, Sensors, simulate
from actuator_glue.diagnosis.verdict.residual_structure import (
    ResidualStructure,
    residual_structure,
)
from actuator_glue.hygiene.clean import initial_state
from actuator_glue.hygiene.impulse_removal import despiked
from actuator_glue.inference.least_squares.data import SETTLE
from actuator_glue.model.structure import Structure
from actuator_glue.records import Hold, Record

NOISE = 1e-5
BOTH = (0.0, 250e3)


def made(
    command: Command,
    stiffnesses: tuple[float, ...] = BOTH,
    seed: int = 1,
    *,
    effects: Mapping[str, Mapping[str, float]] | None = None,
    noise: float = NOISE,
    hold: Hold = 'zoh',
) -> list[Record]:
    """Simulate tests of one actuator."""
    return [
        simulate(
            command,
            stiffness=k,
            effects=effects or {},
            sensors=Sensors(noise=noise),
            hold=hold,
            seed=(seed, i),
        )
        for i, k in enumerate(stiffnesses)
    ]


def asked(records: list[Record]) -> ResidualStructure:
    """Ask as a calibration with Eq. (2) does."""
    rest = all(initial_state(r) == 'rest' for r in records)
    initial = 'rest' if rest else 'measured'
    cleaned, _, near = despiked(records, [initial] * len(records))
    settle = 0.0 if rest else SETTLE
    found = residual_structure(cleaned, initial, settle, Structure(()), near)
    assert found is not None
    return found


@pytest.mark.parametrize('shape', ['sweep', 'noise', 'earthquake', 'sine'])
@pytest.mark.parametrize(
    ('rate', 'duration', 'stiffnesses'),
    [(100.0, 20.0, (250e3,)), (250.0, 8.0, BOTH), (1000.0, 12.0, (0.0,))],
)
def test_noise_is_noise(
    shape: str, rate: float, duration: float, stiffnesses: tuple[float, ...], rng_seed: int
) -> None:
    """Of 90 machines of all kinds none was told of structure that matters."""
    rng = np.random.default_rng(rng_seed)
    noise = float(10.0 ** rng.uniform(-6.0, -4.5))
    shown = Command(shape, rate, duration, high=2.0 if shape == 'sine' else 10.0, seed=rng_seed)
    records = made(shown, stiffnesses, rng_seed, noise=noise)
    if cut := rng.random() < 0.3:
        records = [r.slice(round(1.3 * rate), len(r)) for r in records]
    found = asked(records)
    assert found.intervals_hold and found.problem() is None, found
    if rate < 600.0 and not cut:  # of more samples some become one
        assert found.noise_m == pytest.approx(noise, rel=0.1)


def test_coloured_noise_is_noise(rng_seed: int) -> None:
    """A residual that is not white is asked once more, and found to follow from no motion."""
    rng = np.random.default_rng(rng_seed)
    records = []
    for record in made(Command('sweep', 200.0, 20.0), seed=rng_seed):
        slow = np.zeros(len(record))
        for n, e in enumerate(rng.standard_normal(len(record) - 1)):
            slow[n + 1] = 0.9 * slow[n] + e
        records.append(replace(record, measured=record.measured + 5e-6 * slow))
    assert asked(records).intervals_hold


@pytest.mark.parametrize('shape', ['sweep', 'noise', 'earthquake'])
@pytest.mark.parametrize(
    'effects', [{'backlash': {'backlash': 2e-5}}, {'coulomb-friction': {'coulomb_force': 20.0}}]
)
def test_what_matters_is_told(
    shape: str, effects: Mapping[str, Mapping[str, float]], rng_seed: int
) -> None:
    """Its size comes out whatever the command: one as stationary as noise hides it."""
    found = asked(made(Command(shape, 200.0, 20.0), seed=rng_seed, effects=effects))
    assert not found.intervals_hold and found.matters
    true = (found.rms_m**2 - NOISE**2) ** 0.5
    assert found.structure_m == pytest.approx(true, rel=0.25)
    assert 'run `actuator-glue diagnose`' in str(found.problem())


@pytest.mark.parametrize('rate', [200.0, 1000.0])
@pytest.mark.parametrize(('true', 'given'), [('zoh', 'linear'), ('linear', 'zoh')])
def test_either_hold_is_found(rate: float, true: Hold, given: Hold, rng_seed: int) -> None:
    """A wrong one is half a sample: little may be left of it, and the parameters are others."""
    records = made(Command('sweep', rate, 16.0), seed=rng_seed, hold=true)
    found = asked([replace(r, hold=given) for r in records])
    assert not found.intervals_hold and found.other_fits
    assert f'--hold {true}' in str(found.problem())
    assert found.other_rms_m < found.rms_m
    assert asked(records).intervals_hold


def test_exchanged_stiffnesses_are_named(rng_seed: int) -> None:
    """Without forces nothing else shows it."""
    records = [replace(r, force=None) for r in made(Command('sweep', 200.0, 20.0), seed=rng_seed)]
    wrong = [replace(r, stiffness=k) for r, k in zip(records, BOTH[::-1], strict=True)]
    found = asked(wrong)
    assert found.setup is not None and found.setup.stiffness == BOTH
    assert 'specimen stiffnesses exchanged' in str(found.problem())


def test_a_record_that_is_too_short_says_nothing() -> None:
    """No spectrogram of 150 samples tells noise from anything."""
    (record,) = made(Command('sweep', 50.0, 3.0), (250e3,))
    theta = np.array([134.0, 1.1e9, 2.5e5, 0.5])
    assert residual_structure([record], 'rest', 0.0, Structure(()), theta) is None


def test_what_is_told_of_means_says_so(rng_seed: int) -> None:
    """Noise of 5 um at 2 kHz is less in the means that are fitted: their time is beside it."""
    records = made(Command('sweep', 2000.0, 6.0), seed=rng_seed, noise=5e-6)
    found = asked(records)
    assert found.means_s > 2.0 / 2000.0
    single = found.noise_m * np.sqrt(found.means_s * 2000.0)
    assert 0.75 < single / 5e-6 < 1.1  # the filter is a little wider than a mean
    assert found.amounts().endswith(f' of noise in means over {1e3 * found.means_s:.3g} ms')
    slow = asked(made(Command('sweep', 100.0, 20.0), seed=rng_seed))
    assert slow.means_s == 0.0 and slow.amounts().endswith(' um of noise')
