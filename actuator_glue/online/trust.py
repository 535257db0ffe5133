"""What speaks against a posterior, however well it was sampled."""

from __future__ import annotations

import math

import numpy as np

from actuator_glue.model.linear import coefficients
from actuator_glue.model.parameters import BASE
from actuator_glue.online.channels import ChannelFault
from actuator_glue.online.job import WindowResult
from actuator_glue.online.stream import Contradicted, Window

# As in PosteriorMoments.
RATE_TOO_LOW, PRIOR_CONTRADICTED = 'rate-too-low', 'prior-contradicted'
CHANNELS_WRONG = 'channels-wrong'
# A later window agrees with its prior where its p-value is this large.
_AGREES = 0.05


def natural_frequency(result: WindowResult) -> float:
    """Return the natural frequency of the loop of Eq. (2a) [Hz], median over the draws.

    Args:
        result: a result that has a posterior.
    """
    assert result.frozen is not None
    theta = result.frozen.draws[:, : len(BASE)]
    _, d2, _, d0 = coefficients(theta, result.window.record.known_stiffness())
    return float(np.median(np.sqrt(d0 / d2))) / (2.0 * math.pi)


def sampled_too_slowly(result: WindowResult) -> bool:
    """Return whether the loop's natural frequency is above half of the sample rate.

    The loop then responds within one sample, and any response that fast fits: neither the
    parameters that a sampler finds nor their intervals mean anything.
    """
    return natural_frequency(result) * result.window.record.period > 0.5


class Contradiction:
    """The alarm that samples contradict what was known, for as long as it stands.

    It stands until a window that shares no sample with the one that raised it agrees with its
    prior, or no longer has a prior.

    Attributes:
        since_ns: acquisition time of the first sample that contradicts [ns]; None without alarm.
    """

    def __init__(self) -> None:
        self.since_ns: int | None = None
        self._last_ns = 0

    def take(self, result: WindowResult, events: list[Contradicted]) -> None:
        """Take a finished window, and the alarms that it raised."""
        record, found = result.window.record, result.conflict
        for event in events:
            if self.since_ns is None:
                self.since_ns = record.stamp_ns(event.since - record.first_index)
            self._last_ns = _last_ns(result.window)
        apart = record.start_ns > self._last_ns
        if not events and apart and (found is None or found.p_value >= _AGREES):
            self.since_ns = None

    def lasted(self, window: Window) -> float:
        """Return how long it has stood by the end of a window [s]; NaN where it does not."""
        if self.since_ns is None:
            return math.nan
        return (_last_ns(window) - self.since_ns) * 1e-9


def _last_ns(window: Window) -> int:
    return window.record.stamp_ns(len(window.record) - 1)


def doubts(
    result: WindowResult, contradiction: Contradiction, channels: ChannelFault
) -> list[str]:
    """Return what speaks against a window's posterior, as in PosteriorMoments."""
    found = {
        RATE_TOO_LOW: sampled_too_slowly(result),
        PRIOR_CONTRADICTED: contradiction.since_ns is not None,
        CHANNELS_WRONG: channels.fault != '',
    }
    return [doubt for doubt, stands in found.items() if stands]


def trust(
    result: WindowResult, contradiction: Contradiction, channels: ChannelFault
) -> dict[str, object]:
    """Return the fields of a PosteriorMoments that say whether it can be believed."""
    found = result.conflict
    return {
        'doubts': doubts(result, contradiction, channels),
        'prior_p_value': math.nan if found is None else found.p_value,
        'prior_contradicted': contradiction.since_ns is not None,
        'contradicted_for': contradiction.lasted(result.window),
    }
