"""Spikes and drop-outs of a channel: found, counted, told, and without leverage."""

from dataclasses import replace

import numpy as np
import pytest

from actuator_glue.diagnosis.samples import final_impulses
from actuator_glue.diagnosis.samples.preparation import prepare
from actuator_glue.diagnosis.trial import Trial
from actuator_glue.hygiene import impulses
from actuator_glue.hygiene.impulse_removal import despiked, trimmed, without_impulses
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.inference.least_squares.fit import base_fit, fit
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array, Record

RATE = 256.0
THETA = np.array([235.0, 5.0e10, 4.23e6, 3.3])
T = np.arange(int(24 * RATE)) / RATE
SWEEP = 2e-3 * np.sin(np.pi * (10.0 / 24.0) * T**2)
NOISE = 3e-6


def healthy(
    seed: int, command: Array = SWEEP, effects: tuple[str, ...] = (), *own: float
) -> tuple[Record, Array]:
    """Return a record of a machine and its noise-free response."""
    bare = Record(command, np.zeros(len(T)), 1 / RATE, stiffness=250e3)
    x = Structure(effects).simulate(np.array([*THETA, *own]), bare)
    noise = NOISE * np.random.default_rng(seed).standard_normal(len(T))
    return replace(bare, measured=x + noise), x


@pytest.mark.parametrize('seed', range(3))
def test_clean_channels_have_none(seed: int) -> None:
    """Gaussian noise is never beyond six times itself."""
    record, _ = healthy(seed)
    clean, notes, _ = despiked([record], ['rest'])
    assert notes == []
    assert clean[0] is record


@pytest.mark.parametrize('seed', range(3))
@pytest.mark.parametrize('length', [10, 16, 30])
def test_a_motion_that_comes_and_goes_once_is_no_impulse(length: int, seed: int) -> None:
    """A valve that saturates once takes the piston aside and back; a channel drops out at once.

    (Of 400 humps of each length 5, 5 and 3 were impulses, by their noise; no drop-out was missed.)
    """
    residual = NOISE * np.random.default_rng(seed).standard_normal(len(T))
    still = impulses.Motion([np.zeros(len(T))])
    at = slice(3000, 3000 + length)
    hump, box = residual.copy(), residual.copy()
    hump[at] += 20 * NOISE * np.sin(np.pi * np.arange(0.5, length) / length)
    box[at] += 20 * NOISE
    assert impulses.find(hump, lambda: still, 1 / RATE).count == 0
    found = impulses.find(box, lambda: still, 1 / RATE)
    assert found.samples.tolist() == list(range(at.start, at.stop))


@pytest.mark.parametrize('one_sided', [True, False])
def test_spikes_are_taken_out_and_told(one_sided: bool) -> None:
    """One sample in a hundred, 20 to 40 um; what stands in their place is the motion."""
    record, x = healthy(1)
    rng = np.random.default_rng(2)
    at = rng.choice(np.arange(20, len(T) - 20), len(T) // 100, replace=False)
    size = rng.uniform(25e-6, 40e-6, len(at)) * (
        1.0 if one_sided else rng.choice([-1, 1], len(at))
    )
    y = record.measured.copy()
    y[at] += size
    clean, notes, _ = despiked([replace(record, measured=y)], ['rest'])
    left = clean[0].measured - x
    assert np.abs(left).max() < 8 * NOISE
    assert left.std() == pytest.approx(NOISE, rel=0.05)
    assert f'({len(at)} of {len(T)} samples' in notes[0]
    assert ('all to one side' in notes[0]) is one_sided


def test_drop_outs_do_not_bend_the_fit() -> None:
    """Readings of zero for up to 40 ms amid a motion of millimetres."""
    record, x = healthy(3)
    y, rng = record.measured.copy(), np.random.default_rng(4)
    for at in rng.integers(200, len(T) - 200, 6):
        y[at : at + rng.integers(2, 10)] = 0.0
    given = replace(record, measured=y)
    prepared = prepare([given], [])
    bent, found = base_fit(prepare([record], []).fit).theta, base_fit(prepared.fit).theta
    assert found[0] == pytest.approx(bent[0], rel=0.01)
    assert 10 < len(prepared.impulses[0].samples) < 60
    assert np.abs(prepared.fit.records[0].measured - x).max() < 50e-6
    assert trimmed(prepared.fit)[0] == pytest.approx(THETA[0], rel=0.02)


@pytest.mark.parametrize(
    ('effect', 'sizes'),
    [
        ('backlash', (5e-5,)),
        ('stribeck-friction', (100.0, 1.5, 0.01)),
        ('valve-deadband', (2e-4,)),
    ],
)
@pytest.mark.parametrize('steps', [False, True])
def test_what_the_model_lacks_is_no_impulse(
    effect: str, sizes: tuple[float, ...], steps: bool
) -> None:
    """Kinks and bursts of a motion come with the motion."""
    command = 1e-3 * np.sign(np.sin(np.pi * T)) if steps else SWEEP
    record, _ = healthy(5, command, (effect,), *sizes)
    clean, _, _ = despiked([record], ['rest'])
    changed = clean[0].measured != record.measured
    assert changed.mean() < 1e-3


def sine(rng: np.random.Generator) -> tuple[Array, Array]:
    """Times of a steady test at 500 Hz, and its motion."""
    t = np.arange(40 * 500) / 500.0
    return t, 2.9e-3 * np.sin(2 * np.pi * rng.uniform(1.65, 1.8) * t)


def test_slips_are_no_impulses_whatever_their_phase(rng_seed: int) -> None:
    """Neither where the piston is fastest nor where it is farthest out, but in each cycle."""
    rng = np.random.default_rng(rng_seed)
    _, x = sine(rng)
    # It breaks away beyond 2 mm, on either side, and catches up in 8 ms.
    release = np.flatnonzero(np.diff((np.abs(x) < 2e-3).astype(int)) == 1)
    error = NOISE * rng.standard_normal(len(x))
    lag = np.array([30, 80, 60, 25]) * 1e-6
    for at in release[2:-2]:
        error[at - 1 : at + 3] += np.sign(x[at]) * lag
    motion = np.abs(np.gradient(x)), np.abs(x)
    assert impulses.find(error, lambda: impulses.Motion(motion), 2e-3).count > 30
    phase = np.arctan2(np.gradient(x) / np.gradient(x).std(), x / x.std())
    assert impulses.find(error, lambda: impulses.Motion(motion, phase), 2e-3).count == 0


@pytest.mark.parametrize('dropped', [False, True])
def test_accidents_of_a_sinusoidal_test_are_accidents(dropped: bool, rng_seed: int) -> None:
    """Spikes at any phase, and readings of zero, which show only away from it."""
    rng = np.random.default_rng(rng_seed)
    _, command = sine(rng)
    bare = Record(command, np.zeros(len(command)), 2e-3, stiffness=250e3)
    x = Structure(()).simulate(THETA, bare)
    y = x + NOISE * rng.standard_normal(len(x))
    at = rng.choice(np.arange(500, len(x) - 20, 13), 150, replace=False)
    y[at] = 0.0 if dropped else y[at] + 1e-4
    clean, notes, _ = despiked([replace(bare, measured=y)], ['rest'])
    assert len(notes) == 1
    assert np.abs(clean[0].measured - x).max() < 60e-6


@pytest.mark.parametrize('late', [False, True])
@pytest.mark.parametrize('share', [0.75, 0.85, 0.95])
def test_the_end_of_a_transducer_is_no_impulse(share: float, late: bool) -> None:
    """What is cut off, before the noise or behind it, comes where the piston is far out."""
    record, x = healthy(7)
    limit = share * float(np.abs(x).max())
    first, then = (record.measured, 0.0) if late else (x, record.measured - x)
    cut = replace(record, measured=np.clip(first, -limit, limit) + then)
    clean, notes, _ = despiked([cut], ['rest'])
    assert notes == []
    assert clean[0] is cut


@pytest.mark.parametrize('size', [5e-5, 2e-2])
@pytest.mark.parametrize('count', [20, 100])
def test_accidents_far_out_are_accidents(size: float, count: int) -> None:
    """Spikes that exceed every motion, and readings that drop to zero where it is large."""
    record, x = healthy(8)
    rng = np.random.default_rng(9)
    at = rng.choice(np.arange(20, len(T) - 20, 13), count, replace=False)
    dropped, spiked = record.measured.copy(), record.measured.copy()
    dropped[at], spiked[at] = 0.0, spiked[at] + size
    for y in (dropped, spiked):
        clean, notes, _ = despiked([replace(record, measured=y)], ['rest'])
        assert len(notes) == 1
        assert np.abs(clean[0].measured - x).max() < 60e-6


def test_too_many_are_no_accidents() -> None:
    """What is off in a tenth of the samples is left as it is."""
    noise = NOISE * np.random.default_rng(6).standard_normal(4000)
    noise[::10] += 1e-4
    assert impulses.find(noise, lambda: impulses.Motion([np.ones(4000)]), 1e-3).count == 0


def test_what_passed_for_an_impulse_beside_another_model_is_restored(rng_seed: int) -> None:
    """Of three samples that were taken out one is an impulse beside the right model, too."""
    record, _ = healthy(rng_seed)
    spike, lacked = 500, [2000, 2001, 3000]
    y = record.measured.copy()
    y[spike] += 60e-6
    before = impulses.Impulses(
        np.array([spike, *lacked]), np.array([60e-6, 50e-6, 40e-6, -45e-6]), 3
    )
    taken = y.copy()
    taken[before.samples] -= before.sizes
    data = Data.whole([replace(record, measured=taken)])
    clean, (found,) = without_impulses(data, Structure(()), THETA, [before])
    assert found.samples.tolist() == [spike]
    np.testing.assert_allclose(clean.records[0].measured[lacked], y[lacked], atol=1e-18)
    # Asked for once more nothing changes: not a bit of the data.
    again, same = without_impulses(clean, Structure(()), THETA, [found])
    assert again is clean and same[0] is found


@pytest.mark.slow
def test_what_an_effect_makes_is_not_left_out_of_its_size(rng_seed: int) -> None:
    """Damping under steps, sampled 100 times a second: beside Eq. (2) some passes for impulses.

    On 149 machines of 270; beside the effect, refitted, nothing does. None of twelve machines
    would show it once in 14 000 runs.
    """
    rng, model, shown = np.random.default_rng(rng_seed), Structure(('viscous-damping',)), 0
    true = np.array([97.0, 2.43e9, 1.88e6, 0.118, 6900.0])
    for _ in range(12):
        level = np.repeat(rng.uniform(-1.0, 1.0, 120), 100)
        u = np.asarray(12e-3 * np.convolve(level, np.full(5, 0.2), 'same'), dtype=np.float64)
        records = []
        for k in (940e3, 0.0):
            y = model.simulate(true, Record(u, u, 0.01, k)) + 15e-6 * rng.standard_normal(len(u))
            records.append(Record(u, y, 0.01, k))
        prepared = prepare(records, [])
        shown += any(i.count for i in prepared.impulses)
        found = fit(prepared.fit, model, true)
        trial = Trial(model, 'viscous-damping', found, np.zeros(1))
        clean = final_impulses.without_impulses(prepared, trial)
        assert not any(i.count for i in clean.impulses)
        for record, mended in zip(records, clean.fit.records, strict=True):
            np.testing.assert_allclose(mended.measured, record.measured, rtol=0.0, atol=1e-15)
    assert shown


def test_one_step_of_a_coarse_channel_at_rest_is_rounding() -> None:
    """With pauses between, readings flicker by a step; a reading that is off by twenty is off."""
    command = 8e-3 * np.sin(4.0 * np.pi * T) * (np.floor(T / 2.0) % 2 == 1)
    _, x = healthy(3, command)
    noise, grid = 1e-6 * np.random.default_rng(3).standard_normal(len(T)), 4e-6
    y = np.round((x + noise) / grid) * grid
    record = Record(command, y, 1 / RATE, stiffness=250e3)
    assert despiked([record], ['rest'])[1] == []
    y[[2000, 3000]] += 20.0 * grid
    _, notes, _ = despiked([replace(record, measured=y)], ['rest'])
    assert len(notes) == 1
    assert '2 impulses (2 of 6144 samples, up to ' in notes[0]
