"""Frequency-response band of posterior draws."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from actuator_glue.inference.bands import Band, band
from actuator_glue.model.linear import frequency_response
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
    response = frequency_response(draws[:, : len(BASE)], stiffness, order)
    response = response[np.isfinite(response).all(axis=1)]
    amplitude = band(np.abs(response), settings.levels)
    # Of second order and damped: from 0 to -pi without a jump.
    phase = band(np.asarray(np.angle(response), np.float64), settings.levels)
    keep = np.delete(np.arange(len(order)), at)
    head = settings.headline_frequency
    lag = float(phase.median[at])
    return ResponseBand(
        frequency=order[keep],
        amplitude=_columns(amplitude, keep),
        phase=_columns(phase, keep),
        headline=(head, float(amplitude.median[at]), lag, -lag / (2.0 * np.pi * head)),
    )


def _columns(whole: Band, keep: Array) -> Band:
    return Band(whole.levels, whole.lower[:, keep], whole.median[keep], whole.upper[:, keep])
