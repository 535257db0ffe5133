"""Tracking indicators of hybrid testing, from target and measured displacement."""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft, next_fast_len, prev_fast_len, rfft

from actuator_glue.errors import InputError
from actuator_glue.records import Array, numbers

# Conjugate transform of a target, and its length.
Spectrum: TypeAlias = tuple[NDArray[np.complex128], int]

_LONG = 1 << 20  # samples, of a block and of what is compared in blocks


class FrequencyEvaluation(NamedTuple):
    """The frequency evaluation index: amplitude, delay [s], equivalent frequency [Hz]."""

    amplitude: float
    delay: float
    frequency: float


class Criteria(NamedTuple):
    """Tracking criteria of the benchmark (Silva et al. 2020).

    Attributes:
        j1: lag of the largest cross-correlation, whole samples [s].
        j2: rms of the error over that of the target.
        j3: peak of the error over that of the target.
    """

    j1: float
    j2: float
    j3: float


class TargetMotion:
    """A target, for many displacements that are compared with it: its spectra are taken once.

    Args:
        displacement: asked for, (n,) [m].
        period: between samples [s].

    Raises:
        InputError: as `_checked`.
    """

    def __init__(self, displacement: Array, period: float) -> None:
        self._target, _ = _checked(displacement, displacement)
        if self._target.flags.writeable:
            self._target = self._target.copy()
        self._period = period

    def _of_target(self, measured: Array) -> Array:
        """Return a measured displacement; the target was checked before.

        Raises:
            InputError: as `_checked`.
        """
        measured = _doubles(measured)
        if measured.shape != self._target.shape or not np.isfinite(measured).all():
            _checked(self._target, measured)
        return measured

    @cached_property
    def _weights(self) -> tuple[Array, Array, float]:
        """Weights of a displacement in the index, (n,) each [1/m], and its frequency [Hz].

        The sum of its transform times the target's conjugate over positive frequencies is a sum
        over samples: many displacements need no transform of their own. The real part's weights
        are the target itself, those of the imaginary part its Hilbert transform. The last samples
        of very long ones are left out, where a transform of all would take ten times their memory.
        """
        n = len(self._target)
        if n > _LONG:
            n = prev_fast_len(n, real=True)
        x = rfft(self._target[:n])
        x[0] = 0.0
        power = x.real**2
        power += x.imag**2
        whole = float(power.sum())
        frequency = float(power @ np.arange(len(power))) / (n * self._period * whole)
        x *= 0.5 * n / whole
        if n % 2 == 0:
            x[-1] *= 2.0  # half the rate has no negative frequency beside it
        real = irfft(x, n)
        x *= -1j
        return real, irfft(x, n, overwrite_x=True), frequency

    @cached_property
    def _peak(self) -> float:
        return float(np.abs(self._target).max())

    @cached_property
    def _spectrum(self) -> Spectrum | None:
        return _spectrum(self._target)

    def frequency_evaluation(self, measured: Array) -> FrequencyEvaluation:
        """Return the frequency evaluation index (Guo et al. 2014), its angle by atan2.

        The gain measured over target at every frequency, weighted with the target's power.

        Raises:
            InputError: as `_checked`.
        """
        measured = self._of_target(measured)
        real, imaginary, frequency = self._weights
        measured = measured[: len(real)]
        index = real @ measured - 1j * (imaginary @ measured)
        return FrequencyEvaluation(
            float(abs(index)), float(-np.angle(index) / (2.0 * np.pi * frequency)), frequency
        )

    def criteria(self, measured: Array) -> Criteria:
        """Return J1 to J3.

        Raises:
            InputError: as `_checked`.
        """
        target, measured = self._target, self._of_target(measured)
        lag = largest_lag(target, measured, self._spectrum)
        error = measured - target
        return Criteria(
            lag * self._period,
            float(np.sqrt((error @ error) / (target @ target))),
            float(max(error.max(), -error.min()) / self._peak),
        )

    def tracking_indicator(self, measured: Array) -> float:
        """Return the last value of `tracking_indicator` [m^2], without those before it.

        Raises:
            InputError: as `_checked`.
        """
        target, measured = self._target, self._of_target(measured)
        return float(0.5 * (target[:-1] @ measured[1:] - target[1:] @ measured[:-1]))

    def energy_error(self, measured: Array) -> float:
        """Return the last value of `energy_error` of an elastic specimen, whatever its stiffness.

        Raises:
            InputError: as `_checked`.
        """
        measured = self._of_target(measured)
        # Energies over the stiffness, in blocks.
        lost, most = 0.0, 0.0
        for begin in range(0, len(measured) - 1, _LONG):
            block = slice(begin, begin + _LONG + 1)
            force = measured[block][1:] + measured[block][:-1]
            work = lost + np.cumsum(0.5 * force * np.diff(self._target[block]))
            lost, most = float(work[-1]), max(most, float(work.max()), -float(work.min()))
        whole = most + 0.5 * max(measured.max(), -measured.min()) ** 2
        lost -= 0.5 * (measured[-1] ** 2 - measured[0] ** 2)
        return float(lost / whole) if whole > 0.0 else 0.0


def _spectrum(target: Array) -> Spectrum | None:
    """Return what correlations take of a target; None where it is compared in blocks."""
    if len(target) > _LONG:
        return None
    size = next_fast_len(2 * len(target) - 1, real=True)
    return rfft(target, size).conj(), size


def largest_lag(target: Array, measured: Array, known: Spectrum | None = None) -> int:
    """Return the lag of the largest cross-correlation in samples.

    Args:
        target: displacement asked for, (n,) [m].
        measured: displacement reached, (n,) [m].
        known: conjugate transform of the target and its length, where it was made before.
    """
    n, known = len(target), known or _spectrum(target)
    if known is None:
        return lag_by_blocks(target, measured)
    spectrum, size = known
    found = irfft(rfft(measured, size) * spectrum, size)
    # Lags below zero stand at the end.
    lag = int(np.argmax(found))
    return lag if lag < n else lag - size


def lag_by_blocks(target: Array, measured: Array, most: int = 1 << 17) -> int:
    """Return the lag of the largest cross-correlation in samples, one block after the other.

    A transform of the whole takes hundreds of megabytes of ten minutes at 10 kHz.

    Args:
        target: displacement asked for, (n,) [m].
        measured: displacement reached, (n,) [m].
        most: largest lag, and half of a block's length.
    """
    size = next_fast_len(4 * most, real=True)
    total = np.zeros(size)
    for begin in range(0, len(target), 2 * most):
        asked = target[begin : begin + 2 * most]
        before = max(0, most - begin)  # of the samples that would precede the record
        reached = measured[max(0, begin - most) : begin + len(asked) + most]
        reached = np.concatenate([np.zeros(before), reached])
        total += irfft(rfft(reached, size) * rfft(asked, size).conj(), size)
    return int(np.argmax(total[: 2 * most + 1])) - most


def tracking_indicator(target: Array, measured: Array) -> Array:
    """Return the tracking indicator at each sample, (n,) [m^2] (Mercan and Ricles 2009).

    Half the difference of the areas under measured against target and target against measured:
    the area enclosed so far; it grows where the measured displacement lags.

    Raises:
        InputError: as `_checked`.
    """
    target, measured = _checked(target, measured)
    area = 0.5 * (target[1:] + target[:-1]) * np.diff(measured)
    other = 0.5 * (measured[1:] + measured[:-1]) * np.diff(target)
    return np.concatenate([[0.0], np.cumsum(0.5 * (area - other))])


def energy_error(target: Array, measured: Array, force: Array, stiffness: float) -> Array:
    """Return the energy error over input and strain energy at each sample, (n,).

    The hybrid simulation error monitor (HSEM, Mosqueda et al. 2007): work of the force on what the
    measured displacement misses of the target, over the largest work done along the target so far
    plus the largest strain energy. Negative where the actuator lags: energy goes into the test.

    Args:
        target: displacement asked for, (n,) [m].
        measured: displacement reached, (n,) [m].
        force: of the specimen, (n,) [N].
        stiffness: of the specimen [N/m].

    Raises:
        InputError: as `_checked`, a force of another length, a stiffness that is not positive.
    """
    target, measured = _checked(target, measured)
    force = numbers(force)
    if force.shape != target.shape or not np.isfinite(force).all():
        raise InputError(f'force has shape {force.shape}; give one finite value a sample')
    if not 0.0 < stiffness < np.inf:
        raise InputError(f'stiffness {stiffness:g} N/m: strain energy needs a positive one')
    mean = 0.5 * (force[1:] + force[:-1])
    lost = np.concatenate([[0.0], np.cumsum(mean * np.diff(target - measured))])
    work = np.concatenate([[0.0], np.cumsum(mean * np.diff(target))])
    strain = 0.5 * force**2 / stiffness
    whole = np.maximum.accumulate(np.abs(work)) + np.maximum.accumulate(strain)
    return np.asarray(np.divide(lost, whole, out=np.zeros_like(lost), where=whole > 0.0))


def _checked(target: Array, measured: Array) -> tuple[Array, Array]:
    """Return both as arrays, without a copy of what is one of doubles.

    Raises:
        InputError: not two rows of one length, values that are not finite, a target at rest.
    """
    target, measured = _doubles(target), _doubles(measured)
    if target.ndim != 1 or target.shape != measured.shape or len(target) < 4:
        raise InputError(
            f'target has shape {target.shape}, measured {measured.shape}; give two rows of one '
            'length, four samples or more'
        )
    if not (np.isfinite(target).all() and np.isfinite(measured).all()):
        raise InputError('target or measured displacement has NaN or infinite samples')
    if np.ptp(target) == 0.0:
        raise InputError('the target does not move: nothing to track')
    return target, measured


def _doubles(values: Array) -> Array:
    plain = type(values) is np.ndarray and values.dtype == np.float64
    return values if plain else numbers(values)
