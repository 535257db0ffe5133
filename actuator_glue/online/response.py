"""Frequency-response band of posterior draws."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from actuator_glue.inference.bands import Band, band
from actuator_glue.model.linear import coefficients
from actuator_glue.model.parameters import BASE
from actuator_glue.online.settings import EstimatorSettings
from actuator_glue.records import Array


@dataclass(frozen=True, slots=True, eq=False)
class ResponseBand:
    """Posterior intervals of the frequency response of Eq. (2a).

    Attributes:
        frequency: shape (nf,) [Hz].
        amplitude: ratio of displacement to command amplitude.
        phase: phase, negative is lag [rad].
        headline: frequency [Hz], median amplitude ratio, median phase [rad], delay [s].
    """

    frequency: Array
    amplitude: Band
    phase: Band
    headline: tuple[float, float, float, float]


def response_band(draws: Array, stiffness: float, settings: EstimatorSettings) -> ResponseBand:
    """Return the band of the linear part of the model, effects beyond Eq. (2) left out.

    Args:
        draws: posterior draws (m, p), the first four parameters those of Eq. (2).
        stiffness: specimen stiffness [N/m].
        settings: levels, frequencies, frequency_max and headline_frequency are used.
    """
    frequency = np.linspace(
        settings.frequency_max / settings.frequencies, settings.frequency_max, settings.frequencies
    )
    order = np.sort(np.append(frequency, settings.headline_frequency))
    at = int(np.searchsorted(order, settings.headline_frequency))
    modulus, angle = _polar(draws[:, : len(BASE)], stiffness, order)
    amplitude = band(modulus.T, settings.levels)
    phase = band(angle.T, settings.levels)
    keep = np.delete(np.arange(len(order)), at)
    head = settings.headline_frequency
    lag = float(phase.median[at])
    return ResponseBand(
        frequency=order[keep],
        amplitude=_columns(amplitude, keep),
        phase=_columns(phase, keep),
        headline=(head, float(amplitude.median[at]), lag, -lag / (2.0 * np.pi * head)),
    )


def _polar(theta: Array, stiffness: float, frequency: Array) -> tuple[Array, Array]:
    """Return modulus and phase [rad] of Eq. (2a), (nf, m'), of thetas (m, 4) where it exists.

    As `linear.frequency_response` without complex numbers, and with draws side by side in memory.
    """
    n0, d2, d1, d0 = coefficients(theta, stiffness)
    omega = 2.0 * np.pi * frequency[:, np.newaxis]
    with np.errstate(divide='ignore', invalid='ignore'):
        real, imaginary = d0 - d2 * omega**2, d1 * omega
        modulus = n0 / np.sqrt(real * real + imaginary * imaginary)
    # Of second order and damped: from 0 to -pi without a jump.
    phase = -np.arctan2(imaginary, real)
    exists = np.isfinite(modulus).all(axis=0)
    return (modulus, phase) if exists.all() else (modulus[:, exists], phase[:, exists])


def _columns(whole: Band, keep: Array) -> Band:
    return Band(whole.levels, whole.lower[:, keep], whole.median[keep], whole.upper[:, keep])
