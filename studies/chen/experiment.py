"""The reconstructed experiment: what can be read off its records without any model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studies.chen.library import EQUATION_3, STIFFNESS, Array, Record
from studies.chen.published import CLOSE_UPS

Complex = NDArray[np.complex128]
SWEEP_RATE = 10.0 / 60.0  # Hz/s, Section 2
DURATION = 60.0  # s
NEAR = 0.5  # Hz to each side that counts as "near" a frequency (Figs. 8, 9)
BLOCK = 6.0  # s; blocks alternate between fit and held out, so that both see every frequency


def stiffness_name(test: int) -> str:
    """Return a test's name for people."""
    return f'k = {STIFFNESS[test] / 1e3:g} kN/m' if STIFFNESS[test] else 'k = 0'


def identified_response(test: int, frequency_hz: Array) -> Complex:
    """Return the frequency response of Eq. (3a) (test 0) or (3b) (test 1), shape (nf,)."""
    a1, a0, b0 = EQUATION_3[test]
    s = 2j * np.pi * np.asarray(frequency_hz)
    return np.asarray(b0 / (s**2 + a1 * s + a0), dtype=np.complex128)


def held(response: Complex, frequency_hz: Array, period: float) -> Complex:
    """Return a response as seen from samples of a command held over each period.

    The hold multiplies by sinc(f T) exp(-i pi f T): half a sample of delay (images above the
    Nyquist frequency are 60 dB and more below here).
    """
    turn = np.asarray(frequency_hz) * period
    return np.asarray(response * np.sinc(turn) * np.exp(-1j * np.pi * turn))


@dataclass(frozen=True, slots=True)
class Reading:
    """Amplitude and phase of a sweep response about one frequency (Figs. 3, 4).

    Attributes:
        frequency_hz: frequency read [Hz].
        amplitude: measured over commanded amplitude.
        phase: phase of measured against command [rad], negative where it lags.
        expected: complex response of Eq. (3a) or (3b) under the sampled, held command.
    """

    frequency_hz: float
    amplitude: float
    phase: float
    expected: complex

    @property
    def delay(self) -> float:
        """Phase delay [s]."""
        return -self.phase / (2.0 * np.pi * self.frequency_hz)

    @property
    def decay(self) -> float:
        """Lost share of the amplitude."""
        return 1.0 - self.amplitude


def read_off(
    record: Record, test: int, frequencies_hz: Sequence[float] = CLOSE_UPS
) -> list[Reading]:
    """Read amplitude and phase of a linear sweep at some frequencies.

    A sine and a cosine of the sweep's own phase, each with a linear trend, are fitted to the
    samples within a quarter hertz (at the sweep's end: the last half hertz).

    Args:
        record: a sweep from rest, of constant rate and amplitude.
        test: 0 for Eq. (3a), 1 for Eq. (3b), for the expected value.
        frequencies_hz: where to read [Hz].
    """
    time = record.time
    readings = []
    for wanted in frequencies_hz:
        at = min(wanted / SWEEP_RATE, time[-1] - 0.25 / SWEEP_RATE)
        near = np.abs(time - at) <= 0.25 / SWEEP_RATE
        phase, offset = np.pi * SWEEP_RATE * time[near] ** 2, time[near] - wanted / SWEEP_RATE
        waves = np.stack([np.sin(phase), np.cos(phase)], axis=1)
        basis = np.hstack([waves, offset[:, None] * waves])
        out, into = (
            np.linalg.lstsq(basis, column[near], rcond=None)[0]
            for column in (record.measured, record.command)
        )
        ratio = (out[0] + 1j * out[1]) / (into[0] + 1j * into[1])
        here = np.array([wanted])
        expected = held(identified_response(test, here), here, record.period)[0]
        readings.append(
            Reading(wanted, float(abs(ratio)), float(np.angle(ratio)), complex(expected))
        )
    return readings


def empirical_response(record: Record, test: int, frequency_hz: Array) -> Complex:
    """Return the frequency response read off a sweep, the hold's half sample taken out, (nf,)."""
    read = read_off(record, test, [float(f) for f in frequency_hz])
    response = np.array([r.amplitude * np.exp(1j * r.phase) for r in read])
    hold = held(np.ones(len(read), dtype=np.complex128), frequency_hz, record.period)
    return np.asarray(response / hold)


def frequencies(record: Record) -> Array:
    """Return the sweep's frequency at each sample [Hz]."""
    return record.time * SWEEP_RATE


def near(record: Record, frequency_hz: float) -> slice:
    """Return the samples within half a hertz of a frequency of the sweep."""
    low, high = ((frequency_hz + side) / SWEEP_RATE for side in (-NEAR, NEAR))
    start, stop = np.searchsorted(record.time, (low, high))
    return slice(int(start), int(stop))


def zooms() -> list[tuple[float, float]]:
    """Return time spans [s] of two cycles about 1, 5 and 10 Hz of the sweep."""
    starts = [min(f / SWEEP_RATE - 1.0 / f, DURATION - 2.0 / f) for f in CLOSE_UPS]
    return [(start, start + 2.0 / f) for start, f in zip(starts, CLOSE_UPS, strict=True)]


def blocks(record: Record) -> tuple[list[slice], NDArray[np.bool_]]:
    """Return where a record's fit blocks lie and a mask of its held-out samples, (n,)."""
    size = round(BLOCK / record.period)
    parts = [slice(s, s + size) for s in range(0, len(record) - size // 2, size)]
    held_out = np.zeros(len(record), dtype=np.bool_)
    for part in parts[1::2]:
        held_out[part] = True
    return parts[0::2], held_out
