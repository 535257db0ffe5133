"""Commanded displacements: the paper's sweep, sine, band-limited noise, earthquake, recorded."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy

from actuator_glue.errors import InputError
from actuator_glue.motion import METRES
from actuator_glue.records import MAX_DISPLACEMENT, Array, Record

MAX_SAMPLES = 100_000_000  # 800 MB: beyond this a rate or duration is a slip of the unit


def _times(rate: float, duration: float, amplitude: float) -> Array:
    """Return sample times 0..duration, both ends included, shape (n,) [s]."""
    if not (np.isfinite(rate) and rate > 0.0):
        raise InputError(f'rate {rate:g} Hz is not positive; give samples per second')
    if not (np.isfinite(duration) and duration * rate >= 1.0):
        raise InputError(f'duration {duration:g} s holds no full sample at {rate:g} Hz')
    if duration * rate > MAX_SAMPLES:
        raise InputError(f'{duration:g} s at {rate:g} Hz is more than {MAX_SAMPLES} samples')
    if not 0.0 <= amplitude <= MAX_DISPLACEMENT:
        raise InputError(
            f'amplitude {amplitude:g} m is outside [0, {MAX_DISPLACEMENT:g}] m; give it in m'
        )
    return np.arange(round(duration * rate) + 1) / rate


def _band(rate: float, *frequencies: float) -> None:
    for f in frequencies:
        if not 0.0 <= f < rate / 2.0:
            raise InputError(
                f'frequency {f:g} Hz is outside [0, {rate / 2.0:g}) Hz at {rate:g} Hz'
            )


def sweep(
    rate: float,
    duration: float = 60.0,
    f0: float = 0.0,
    f1: float = 10.0,
    amplitude: float = 2e-3,
) -> Array:
    """Return a linear sine sweep from f0 to f1, shape (n,) [m].

    The defaults are the paper's tests (Sec. 2.2), u = 2 sin(pi (10/60) t^2) mm.

    Args:
        rate: samples per second [Hz].
        duration: length [s]; both end samples are included.
        f0: frequency at the start [Hz].
        f1: frequency at the end [Hz].
        amplitude: peak displacement [m].

    Raises:
        InputError: not positive, beyond the Nyquist frequency, or absurd in size.
    """
    t = _times(rate, duration, amplitude)
    _band(rate, f0, f1)
    return amplitude * np.sin(2.0 * np.pi * (f0 * t + 0.5 * (f1 - f0) / duration * t * t))


def sine(
    rate: float, duration: float = 60.0, frequency: float = 1.0, amplitude: float = 2e-3
) -> Array:
    """Return a sine that starts at zero displacement, shape (n,) [m].

    Raises:
        InputError: as `sweep`.
    """
    return sweep(rate, duration, frequency, frequency, amplitude)


def noise(
    rate: float,
    duration: float = 60.0,
    f0: float = 0.1,
    f1: float = 10.0,
    amplitude: float = 2e-3,
    seed: int = 0,
) -> Array:
    """Return band-limited Gaussian noise that starts and ends at rest, shape (n,) [m].

    A flat spectrum between f0 and f1, faded in and out over a tenth of the duration (5 s at
    most) and scaled to its peak.

    Args:
        rate: samples per second [Hz].
        duration: length [s].
        f0: lower band edge [Hz].
        f1: upper band edge [Hz].
        amplitude: peak displacement [m].
        seed: same seed, same command.

    Raises:
        InputError: as `sweep`, or a band that no frequency of this duration falls into.
    """
    t = _times(rate, duration, amplitude)
    _band(rate, f0, f1)
    n = len(t)
    frequency = np.fft.rfftfreq(n, 1.0 / rate)
    inside = (frequency >= f0) & (frequency <= f1) & (frequency > 0.0)
    if not inside.any():
        raise InputError(f'no frequency in {f0:g}..{f1:g} Hz fits {duration:g} s; widen the band')
    rng = np.random.default_rng(seed)
    spectrum = inside * (rng.standard_normal(inside.size) + 1j * rng.standard_normal(inside.size))
    u = np.fft.irfft(spectrum, n) * scipy.signal.windows.tukey(n, 2.0 * min(0.1, 5.0 / duration))
    return _scaled(u, amplitude)


def earthquake(
    rate: float,
    duration: float = 40.0,
    amplitude: float = 20e-3,
    seed: int = 0,
    ground_hz: float = 2.5,
    ground_damping: float = 0.6,
    corner_hz: float = 0.25,
    corner_damping: float = 0.7,
) -> Array:
    """Return an earthquake-like ground displacement, shape (n,) [m].

    White noise under the envelope of Saragoni and Hart (1974), t^2 exp(-t/tau) with its peak at
    a fifth of the duration, drives the Kanai-Tajimi ground filter; the high-pass of Clough and
    Penzien (1993) keeps the displacement bounded and lets it return to zero.

    Args:
        rate: samples per second [Hz].
        duration: length [s].
        amplitude: peak displacement [m].
        seed: same seed, same command.
        ground_hz: Kanai-Tajimi ground frequency [Hz].
        ground_damping: its damping ratio.
        corner_hz: Clough-Penzien corner frequency [Hz].
        corner_damping: its damping ratio.

    Raises:
        InputError: as `sweep`, or damping outside (0, 10].
    """
    t = _times(rate, duration, amplitude)
    _band(rate, ground_hz, corner_hz)
    for name, value in (('ground_damping', ground_damping), ('corner_damping', corner_damping)):
        if not 0.0 < value <= 10.0:
            raise InputError(f'{name} {value:g} is outside (0, 10]')
    # Twice integrated (1/s^2) the high-pass s^2/(s^2 + ...) of Clough and Penzien has no zeros.
    ground, corner = (ground_hz, ground_damping), (corner_hz, corner_damping)
    return _scaled(_kanai_tajimi(t, rate, seed, ground, corner, [1.0]), amplitude)


def ground_acceleration(
    rate: float, duration: float = 40.0, peak: float = 1.37, seed: int = 0
) -> Array:
    """Return the acceleration of an earthquake as `earthquake` makes them, shape (n,) [m/s^2].

    Args:
        rate: samples per second [Hz].
        duration: length [s].
        peak: largest acceleration; 1.37 m/s^2 is 40 % of El Centro 1940 [m/s^2].
        seed: same seed, same motion.

    Raises:
        InputError: as `sweep`.
    """
    t = _times(rate, duration, 0.0)
    _band(rate, 2.5)
    return _scaled(_kanai_tajimi(t, rate, seed, (2.5, 0.6), (0.25, 0.7), [1.0, 0.0, 0.0]), peak)


def _kanai_tajimi(
    t: Array,
    rate: float,
    seed: int,
    ground: tuple[float, float],
    corner: tuple[float, float],
    highpass: Sequence[float],
) -> Array:
    """Return filtered noise under an envelope; filters as (frequency [Hz], damping ratio)."""
    tau = 0.1 * float(t[-1])
    envelope = (t / (2.0 * tau)) ** 2 * np.exp(2.0 - t / tau)
    drive = envelope * np.random.default_rng(seed).standard_normal(len(t))
    (wg, zg), (wf, zf) = ((2.0 * np.pi * hz, damping) for hz, damping in (ground, corner))
    numerator = np.polymul([2.0 * zg * wg, wg**2], highpass)
    denominator = np.polymul([1.0, 2.0 * zg * wg, wg**2], [1.0, 2.0 * zf * wf, wf**2])
    z = scipy.signal.bilinear(numerator, denominator, rate)
    return np.asarray(scipy.signal.sosfilt(scipy.signal.tf2sos(*z), drive))


def in_metres(record: Record) -> Array:
    """Return a record's command, shape (n,) [m].

    Raises:
        InputError: it is no displacement: degrees, counts, volts.
    """
    if record.motion != METRES:
        where = f'{record.source}: ' if record.source else ''
        raise InputError(
            f'{where}the command is in {record.motion}, and the simulated actuator moves '
            f'in metres; give mm per {record.motion} as `scale`, with `unit: mm`, in a channel map'
        )
    return record.command


def recorded(record: Record, rate: float | None = None, amplitude: float | None = None) -> Array:
    """Return a record's command at another rate or amplitude, shape (n,) [m].

    Between its samples the command runs as the record's hold says.

    Args:
        record: where the command comes from.
        rate: samples per second [Hz]; the record's own if None.
        amplitude: peak displacement [m]; the record's own if None.

    Raises:
        InputError: as `sweep`, or a record that moves in another unit than metres.
    """
    u = in_metres(record)
    if rate is not None and rate != record.rate:
        t = _times(rate, (len(u) - 1) * record.period, 0.0)
        if record.hold == 'linear':
            u = np.interp(t, record.time, u)
        else:
            # The small share keeps a time that equals a sample's from falling before it.
            u = u[np.minimum((t * record.rate + 1e-6).astype(np.int64), len(u) - 1)]
    return u.copy() if amplitude is None else _scaled(u, amplitude)


def _scaled(u: Array, amplitude: float) -> Array:
    peak = float(np.abs(u).max())
    return u * (amplitude / peak) if peak > 0.0 else np.zeros_like(u)
