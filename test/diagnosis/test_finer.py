"""What decimation changes of a simulation is no misfit of the truth: posteriors do without it."""

from dataclasses import replace

import numpy as np
import pytest

from actuator_glue.diagnosis.samples.preparation import prepare
from actuator_glue.inference.least_squares import data as module
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.inference.least_squares.decimate import means
from actuator_glue.inference.least_squares.fit import fit
from actuator_glue.model import commands
from actuator_glue.model.effects.run import sample_steps
from actuator_glue.model.structure import Structure
from actuator_glue.records import Record

MODEL = Structure(('stribeck-friction',))
THETA = np.array([128.0, 1.01e9, 2.42e5, 0.3, 300.0, 1.5, 0.02])


def decimated(
    rate: float = 1000.0, noise: float = 0.0, rng: np.random.Generator | None = None
) -> Data:
    """Return a sweep that was sampled fast, with noise [m], as it is fitted."""
    command = commands.sweep(rate, 20.0, 0.0, 5.0, 2e-3)
    silent = Record(command, command, 1 / rate, stiffness=250e3)
    moved = MODEL.simulate(THETA, silent)
    if rng is not None:
        moved = moved + noise * rng.standard_normal(len(moved))
    return prepare([Record(command, moved, 1 / rate, stiffness=250e3)], []).fit


def finer(data: Data) -> Data:
    """Return the same samples, simulated as recorded, or nearly."""
    return replace(data, finer=True)


def coarse(data: Data) -> Data:
    """Return the same samples, known at their own rate only."""
    return replace(data, recorded=data.records, steps=())


def misfit(data: Data, theta: np.ndarray) -> float:
    """Rms that parameters leave [m]."""
    return float(np.sqrt(np.mean((data.target - data.simulate(MODEL, theta)[0]) ** 2)))


def test_the_truth_leaves_nothing() -> None:
    """With the kernel's steps as samples, here those recorded; without it leaves micrometres."""
    data = decimated()
    assert max(data.factors) > 1
    assert misfit(coarse(data), THETA) > 5e-7
    assert misfit(data, THETA) < 1e-12


def test_the_steps_of_a_fast_record_are_samples() -> None:
    """A third of what decimation leaves is left, in no more steps."""
    data = decimated(5000.0)
    simulated = data.simulated(MODEL)
    assert len(data.records[0]) < simulated < len(data.recorded[0])
    steps = sample_steps(data.records[0].period) * len(data.records[0])
    assert simulated <= 1.1 * steps
    assert misfit(data, THETA) < 0.33 * misfit(coarse(data), THETA)


@pytest.mark.parametrize('most', [4, 8])
def test_a_long_record_is_simulated_as_fine_as_may_be(
    most: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Some samples become one before, others after: a fraction of the misfit is left."""
    data = decimated(5000.0)
    assert max(data.factors) % 4 == 0
    monkeypatch.setattr(module, '_LONGEST', most * len(data.records[0]))
    assert misfit(finer(data), THETA) < 1.2 * misfit(coarse(data), THETA) / most


def test_a_record_too_long_for_more_keeps_its_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    """Half an hour of 10 kHz has more samples than are simulated finer."""
    data = decimated(5000.0)
    monkeypatch.setattr(module, '_LONGEST', len(data.records[0]) - 1)
    assert finer(data).simulated(MODEL) == data.simulated(MODEL)


def ahead(data: Data, start: np.ndarray) -> float:
    """Nats by which a fit is ahead of the truth."""
    found = fit(data, MODEL, start, iterations=25)
    return len(data.target) * float(np.log(misfit(data, THETA) / found.rms))


def test_the_truth_is_no_less_likely_than_the_fit(rng_seed: int) -> None:
    """A fit to the decimated record is 110 to 180 nats ahead of the truth.

    Of 40 seeds it was 0.3 to 9.1 nats ahead with steps as samples (seven parameters: 3.5 on
    average, 3.7 found): the chance of more than 15 is 1e-4 (a chi-square of seven over 30).
    """
    data = decimated(noise=3e-6, rng=np.random.default_rng(rng_seed))
    assert ahead(coarse(data), THETA) > 50.0
    assert ahead(data, THETA) < 15.0


def test_records_at_their_own_rate_are_simulated_as_they_are() -> None:
    """There is nothing finer."""
    data = decimated(250.0)
    np.testing.assert_array_equal(data.simulate(MODEL, THETA), finer(data).simulate(MODEL, THETA))


@pytest.mark.parametrize('effects', [('gain',), ('delay',)])
def test_what_is_linear_hardly_changes(effects: tuple[str, ...]) -> None:
    """A linear actuator relates the means as it relates the samples."""
    data, model = decimated(), Structure(effects)
    theta = np.append(THETA[:4], [1.02 if effects == ('gain',) else 3e-3])
    rows = zip(data.recorded, data.masks, data.factors, strict=True)
    whole = [means(model.simulate(theta, r), n)[mask] for r, mask, n in rows]
    change = np.concatenate(whole) - data.simulate(model, theta)[0]
    assert np.sqrt(np.mean(change**2)) < 1e-7
