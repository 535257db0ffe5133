"""Whether a command is one of velocity, or of a valve: its integral is what moves."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

_MOST = 200_000  # samples that are compared
_LATEST = 0.25  # s; no actuator follows later
_LEAST = 64  # samples; of fewer nothing is said
_ALIKE = 0.8  # correlation from which a channel follows the command itself
_INTEGRAL = 0.95  # correlation from which it follows the command's integral


def is_velocity(command: ArrayLike, measured: ArrayLike, rate: float) -> bool:
    """Return whether what is measured follows the integral of a command, and not the command.

    A line is taken off both integral and displacement: an offset of the command would hide the
    rest. A single sine and its integral are alike, so that nothing is said of it.

    Args:
        command: shape (n,).
        measured: shape (n,), of any unit.
        rate: samples per second [Hz].
    """
    u = np.asarray(command, dtype=np.float64)[:_MOST]
    x = np.asarray(measured, dtype=np.float64)[:_MOST]
    if len(u) != len(x) or len(u) < _LEAST or not np.isfinite(u).all() or not np.isfinite(x).all():
        return False
    latest = max(1, min(round(_LATEST * rate), len(u) // 4))
    if _likeness(u - u.mean(), x - x.mean(), latest) > _ALIKE:
        return False
    return _likeness(_level(np.cumsum(u - u.mean())), _level(x), latest) > _INTEGRAL


def _level(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return values less their straight line."""
    at = np.linspace(-1.0, 1.0, len(values))
    slope = float(at @ values) / float(at @ at)
    return np.asarray(values - values.mean() - slope * at)


def _likeness(one: NDArray[np.float64], other: NDArray[np.float64], latest: int) -> float:
    """Return the greatest correlation of either sign at lags up to `latest` either way."""
    norm = float(np.linalg.norm(one) * np.linalg.norm(other))
    if norm == 0.0:
        return 0.0
    size = 1 << (2 * len(one) - 1).bit_length()
    cross = np.fft.irfft(np.conj(np.fft.rfft(one, size)) * np.fft.rfft(other, size), size)
    near = np.concatenate([cross[: latest + 1], cross[-latest:]])
    return float(np.abs(near).max()) / norm
