"""Impulses of the recorded command that no actuator was given."""

from dataclasses import replace

import numpy as np
import pytest

from actuator_glue.diagnosis.samples.preparation import prepare
from actuator_glue.hygiene import glitches
from actuator_glue.model import commands
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array, Record

RATE = 256.0
THETA = np.array([128.0, 1.01e9, 2.42e5, 0.3])
NOISE = 1e-5


def spikes(rng: np.random.Generator, n: int) -> Array:
    """One sample in a hundred is off to one side by 20 to 100 um, some beside each other."""
    return np.where(rng.random(n) < 0.01, rng.uniform(2e-5, 1e-4, n), 0.0)


def made(rng: np.random.Generator, given: Array) -> Record:
    """What a machine makes of a command, read with noise."""
    u = np.asarray(given)
    y = Structure(()).simulate(THETA, Record(u, u, 1.0 / RATE, stiffness=250e3))
    return Record(u, y + NOISE * rng.standard_normal(len(u)), 1.0 / RATE, stiffness=250e3)


def sweep(duration: float = 30.0) -> Array:
    """To 10 Hz, 2 mm."""
    return commands.sweep(RATE, duration, 0.1, 10.0, 2e-3)


@pytest.mark.parametrize('both', [True, False])
def test_what_was_only_recorded_is_taken_out(both: bool, rng_seed: int) -> None:
    """In both channels or in the command alone; more than three close to each other stay.

    Those are a seventh of all squares in one run of 300, never more than 0.18 in 1000.
    """
    rng = np.random.default_rng(rng_seed)
    record = made(rng, sweep())
    off = spikes(rng, len(record))
    read = record.measured + off if both else record.measured
    spiky = replace(record, command=record.command + off, measured=read)
    (out,), notes = glitches.mended([spiky], ['rest'])
    most = 0.3 * np.sum(off**2)
    assert np.sum((out.command - record.command) ** 2) < most
    (note,) = notes
    assert 'did not move the piston' in note
    assert ('taken out there, too' in note) == both
    assert np.sum((out.measured - record.measured) ** 2) < most


@pytest.mark.parametrize(
    ('moved', 'error', 'read', 'never'),
    [
        (0.02, 0.1, 0.0, True),
        (0.3, 0.5, 1.0, True),
        (0.3, 0.5, 0.0, False),
        # Off by what hysteresis takes, nearer to none than to all of it.
        (-0.85, 0.15, 1.0, True),
        (1.0, 0.1, 0.0, False),
        # What the model lacks, not a share of anything: a machine that drifts.
        (-425.0, 65.0, 0.0, False),
        (-425.0, 65.0, 1.0, False),
    ],
)
def test_a_share_is_one_of_a_response(
    moved: float, error: float, read: float, never: bool
) -> None:
    """None of it is in the motion: surely, or as the reading has the impulses."""
    assert glitches.never_given(glitches.Traces(moved, error, read, 0.05)) is never


def test_what_was_commanded_stays(rng_seed: int) -> None:
    """The piston answers impulses that it was given: the very same record."""
    rng = np.random.default_rng(rng_seed)
    record = made(rng, sweep() + spikes(rng, len(sweep())))
    assert len(glitches.impulses(record.command, record.period)[0]) > 20
    (out,), notes = glitches.mended([record], ['rest'])
    assert out is record
    assert not notes


@pytest.mark.parametrize('command', ['sweep', 'steps', 'triangle', 'grid', 'noise', 'random'])
def test_commands_that_are_whole_have_none(command: str, rng_seed: int) -> None:
    """Corners, steps, a grid of 5 um and noise are no impulses of a few samples."""
    rng, u = np.random.default_rng(rng_seed), sweep()
    t = np.arange(len(u)) / RATE
    match command:
        case 'steps':
            u = 1e-3 * np.round(3.0 * np.sin(t))
        case 'triangle':
            u = 2e-3 * np.abs(2.0 * (0.7 * t % 1.0) - 1.0)
        case 'grid':
            u = 5e-6 * np.round(u / 5e-6)
        case 'noise':
            u = u + 1e-5 * rng.standard_normal(len(u))
        case 'random':
            f = np.fft.rfftfreq(len(u), 1.0 / RATE)
            z = rng.standard_normal((2, len(f))).T @ np.array([1.0, 1j])
            u = np.fft.irfft(np.where((f > 0.2) & (f < 12.0), z, 0.0), len(u))
            u *= 2e-3 / np.abs(u).max()
    # Of 7680 Gaussian samples one is beyond six standard deviations once in 60 000 runs.
    assert not len(glitches.impulses(u, 1.0 / RATE)[0])


def test_a_rough_command_shares_what_its_reading_lost(rng_seed: int) -> None:
    """Steps of a slow controller hide impulses in it; those of the reading are in it, too.

    Taken out of the reading alone, to one side, they would be a bias. The share is off by 0.048
    (one standard deviation of 2000 runs, the largest 0.16): 0.2 is beyond four of them.
    """
    rng = np.random.default_rng(rng_seed)
    slow = commands.sweep(RATE, 30.0, 2.0, 5.0, 5e-4)[::2]
    record = made(rng, np.repeat(slow, 2))
    assert not len(glitches.impulses(record.command, record.period)[0])
    off = np.where(rng.random(len(record)) < 0.01, rng.uniform(9e-5, 1.5e-4, len(record)), 0.0)
    both = replace(record, command=record.command + off, measured=record.measured + off)
    prepared = prepare([both], [record])
    (clean,) = prepared.fit.records
    (found,) = prepared.impulses
    assert found.count > 0.5 * np.count_nonzero(off)
    assert found.shared == pytest.approx(1.0, abs=0.2)
    assert np.mean(clean.measured - record.measured) < 0.4 * np.mean(off)
    for fitted in (clean, prepared.fit.recorded[0], prepared.fit.steps[0]):
        left = fitted.command - record.command
        assert np.mean(left) < 0.4 * np.mean(off)
        bias = np.mean(left) - np.mean(clean.measured - record.measured)
        assert np.abs(bias) < 0.2 * np.mean(off)
    alone = replace(both, command=record.command)
    (other,) = prepare([alone], [record]).impulses
    assert other.shared == 0.0


def test_a_valve_that_remembers_is_not_pushed(rng_seed: int) -> None:
    """Hysteresis keeps what an impulse did to it: simulated with them it is many um off.

    Of 1000 seeds none failed; with half of the time 3, where the share was 0.5 by chance.
    """
    rng, valve = np.random.default_rng(rng_seed), Structure(('valve-hysteresis',))
    theta, records = np.append(THETA, 25e-6), []
    for k in (0.0, 250e3):
        u = sweep(40.0)
        y = valve.simulate(theta, Record(u, u, 1.0 / RATE, stiffness=k))
        off = spikes(rng, len(u))
        y = y + off + NOISE * rng.standard_normal(len(u))
        records.append(Record(u + off, y, 1.0 / RATE, stiffness=k))
    prepared = prepare(records[:1], records[1:])
    assert sum('did not move the piston' in note for note in prepared.remarks) == 2
    for raw, clean in zip(records, (*prepared.fit.records, *prepared.held.records), strict=True):
        before, after = (
            np.std(r.measured - valve.simulate(theta, r, initial='rest')) for r in (raw, clean)
        )
        assert after < 1.1 * NOISE < before
