"""A held-out look: its noise, and its control, the best of as many shams as candidates."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import signal

from actuator_glue.diagnosis.samples import record_zero
from actuator_glue.diagnosis.verdict import held_out_look
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.inference.least_squares.fit import rms
from actuator_glue.model.parameters import TABLE_2
from actuator_glue.model.structure import Structure
from actuator_glue.records import Record

RATE = 64.0
T = np.arange(int(30 * RATE)) / RATE


def test_the_sham_is_the_best_of_as_many_as_were_tried() -> None:
    """Chosen on the fitting part, as an effect is: there the best of more is never worse."""
    side = held_out_look.Side(Structure(()), TABLE_2, TABLE_2[None])
    command = 2e-3 * np.sin(np.pi * (8.0 / 30.0) * T**2)
    data = Data.whole([Record(command, 0.0 * command, 1 / RATE, stiffness=0.0)])
    rng = np.random.default_rng(3)
    # A residual that follows the command by chance, as wrong models leave.
    error = np.convolve(rng.standard_normal(len(T)), np.hanning(15), 'same')
    errors = (error, error)
    left = [
        held_out_look._sham(data, data, side, errors, (1, count), seed=4)
        for count in (1, 2, 8, 16)
    ]
    assert np.all(np.diff(left) <= 0.0)
    assert left[-1] < left[0] < rms(error)
    # The choice is the fitting part's: elsewhere it adds to an error that it never saw.
    other = rng.standard_normal(len(T))
    assert held_out_look._sham(data, data, side, (error, other), (1, 16), seed=4) > rms(other)


def test_the_noise_of_other_records_is_theirs_and_what_is_missed_is_not() -> None:
    """Twice the noise is noise; what a random command makes of a wrong model is as stationary.

    The floor scatters by 2 % over seeds.
    """
    rng = np.random.default_rng(8)
    data = Data.whole([Record(0.0 * T, 0.0 * T, 1 / RATE, stiffness=0.0)])
    known = 1e-5 * rng.standard_normal(len(T))
    other = 1e-5 * rng.standard_normal(len(T))
    band = signal.butter(4, [1.0, 5.0], 'bandpass', fs=RATE, output='sos')
    missed = signal.sosfilt(band, rng.standard_normal(len(T)))
    missed *= 1.5e-5 / missed.std()
    quiet, loud, wrong = (
        held_out_look.noise_floor(data, data, (known, error), 1e-5)
        for error in (0.5 * other, 2.0 * other, other + missed)
    )
    assert quiet == pytest.approx(0.5e-5, rel=0.1)
    assert loud == pytest.approx(2e-5, rel=0.1)
    assert wrong == pytest.approx(1e-5, rel=0.15)


def test_a_zero_is_a_straight_line_of_each_record(rng_seed: int) -> None:
    """Offset and drift go, whatever the record's samples that count; what moves stays."""
    rng = np.random.default_rng(rng_seed)
    records = [Record(0.0 * T, 0.0 * T, 1 / RATE, stiffness=0.0) for _ in range(2)]
    data = Data.whole(records)
    mask = rng.random(len(T)) < 0.7
    data = replace(data, masks=(mask, data.masks[1]))
    rest = 1e-5 * rng.standard_normal(data.target.size)
    off = np.concatenate([3e-5 + 1e-6 * t for t in data.times])
    off[data.parts[1]] *= -0.5
    left = record_zero.without(data, rest + off)
    assert left == pytest.approx(record_zero.without(data, rest), abs=1e-15)
    # Four numbers of some 3300 samples.
    assert rms(rest) * 0.99 < rms(left) < rms(rest) < 0.5 * rms(rest + off)
