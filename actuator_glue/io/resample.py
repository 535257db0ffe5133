"""From a jittered clock to even samples, on request, by straight lines; and what that costs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.even_times import span
from actuator_glue.records import Array

# Of the mean rate of the samples: below, what is faster would be folded into the band; far above
# there would be samples that nobody measured.
_LEAST, _MOST = 0.8, 2.0
_LONGEST_STEP = 5.0  # median steps without a sample: beyond it is a gap, not jitter
_KEPT = 0.95  # share of its amplitude that a sine keeps in the band that is told
# A parabola's mean square over its step, and its error over two steps at the sample between.
_WITHIN = np.sqrt(8.0 / 15.0) / 4.0


@dataclass(frozen=True, slots=True)
class Resampled:
    """Channels at even times, and what straight lines between samples changed.

    Attributes:
        values: by role, the first sample at the time of the first one measured; without times.
        period: [s].
        steps: shortest and longest step of the recorded clock, in words.
        band: frequency above which sines lost more than 5 % of their amplitude [Hz].
        error: root mean square of what straight lines miss between samples, by role, in the unit
            of the channel: from each sample and the line between its neighbours; noise counts in.
        noise: mean share of the variance of white noise that is left, (1 - w)^2 + w^2 for a
            weight w [1].
    """

    values: dict[str, Array]
    period: float
    steps: str
    band: float
    error: dict[str, float]
    noise: float

    def told(self) -> str:
        """Return what was done and lost, in a line."""
        missed = ', '.join(
            f'{role} {1e6 * error:.3g} um' for role, error in self.error.items() if role != 'force'
        )
        return (
            f'{self.name()} by straight lines between samples that are {self.steps} apart: above '
            f'{self.band:.2g} Hz more than 5 % of an amplitude is lost, between samples the lines '
            f'miss {missed} (rms), and {100.0 * self.noise:.0f} % of the variance of noise is left'
        )

    def name(self) -> str:
        """Return what was done, in three words."""
        return f'resampled to {1.0 / self.period:.6g} Hz'


def resample_evenly(values: dict[str, Array], rate: float, where: str) -> Resampled:
    """Return channels at even times.

    Args:
        values: channels by role, each of shape (n,), with `time` [s].
        rate: samples per second that are wanted.
        where: file, for messages.

    Raises:
        InputError: times that are no numbers, go back or stand still, a gap, or a rate far from
            that of the samples.
    """
    time = values['time']
    steps = np.diff(time)
    if len(steps) < 2 or not np.isfinite(time).all() or not steps.min() > 0.0:
        at = int((~(steps > 0.0)).argmax()) if len(steps) else 0
        raise InputError(
            f'{where}: time does not go up after sample {at}; sort the record, or cut it there'
        )
    typical, mean = float(np.median(steps)), float(steps.mean())
    spacing = float(np.sqrt(np.sum(steps**3) / np.sum(steps)))  # long steps last longer
    at = int(steps.argmax())
    if steps[at] > _LONGEST_STEP * typical:
        raise InputError(
            f'{where}: {steps[at]:.4g} s without samples after sample {at}; nobody knows what '
            'happened there: cut the record there before it is resampled'
        )
    if not _LEAST <= rate * mean <= _MOST:
        raise InputError(
            f'{where}: there are {1.0 / mean:.4g} samples per second; resample to between '
            f'{_LEAST / mean:.3g} and {_MOST / mean:.3g} Hz, not {rate:g}'
        )
    even = np.arange(int((time[-1] - time[0]) * rate * (1.0 + 1e-12)) + 1) / rate
    passed = time - time[0]
    before = np.clip(np.searchsorted(passed, even, side='right') - 1, 0, len(steps) - 1)
    weight = (even - passed[before]) / steps[before]
    channels = {role: column for role, column in values.items() if role != 'time'}
    # A straight line keeps sinc^2(f T) of a sine: 1 - (pi f T)^2 / 3 of it near 1.
    band = float(np.sqrt(3.0 * (1.0 - _KEPT))) / (np.pi * spacing)
    return Resampled(
        values={role: np.interp(even, passed, column) for role, column in channels.items()},
        period=1.0 / rate,
        steps=span(steps),
        band=band,
        error={role: _WITHIN * _left_out(passed, column) for role, column in channels.items()},
        noise=float(np.mean((1.0 - weight) ** 2 + weight**2)),
    )


def _left_out(time: Array, column: Array) -> float:
    """Return the root mean square of each sample against the line between its neighbours."""
    weight = (time[1:-1] - time[:-2]) / (time[2:] - time[:-2])
    line = (1.0 - weight) * column[:-2] + weight * column[2:]
    return float(np.sqrt(np.mean((column[1:-1] - line) ** 2)))
