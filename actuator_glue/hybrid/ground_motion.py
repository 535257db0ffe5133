"""Ground motions of hybrid tests: artificial ones, and any at the loop's sample rate."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.model.commands import ground_acceleration
from actuator_glue.records import Array, numbers

_LONGEST = 5_000_000  # samples at the loop's rate
_LARGEST = 100.0  # m/s^2
_RATE = 200.0  # Hz, of artificial motions


@dataclass(frozen=True, slots=True, eq=False)
class GroundMotion:
    """Ground acceleration at even times.

    Attributes:
        acceleration: (n,) [m/s^2].
        period: [s].
        name: in reports.

    Raises:
        InputError: not one row of finite samples that move, or beyond any earthquake.
    """

    acceleration: Array
    period: float
    name: str = 'ground motion'

    def __post_init__(self) -> None:
        values = numbers(self.acceleration)
        object.__setattr__(self, 'acceleration', values)
        if values.ndim != 1 or len(values) < 2 or not np.isfinite(values).all():
            raise InputError(f'{self.name}: not one row of two or more finite accelerations')
        if not 1e-6 <= self.period <= 1.0:
            raise InputError(f'{self.name}: period {self.period:g} s is outside [1e-6, 1] s')
        peak = float(np.abs(values).max())
        if not 0.0 < peak <= _LARGEST:
            raise InputError(
                f'{self.name}: the largest acceleration is {peak:g} m/s^2; more than 0 and at '
                f'most {_LARGEST:g} is an earthquake (accelerations are in m/s^2)'
            )

    @property
    def duration(self) -> float:
        """Length [s]."""
        return (len(self.acceleration) - 1) * self.period

    def scaled(self, factor: float) -> GroundMotion:
        """Return the motion times a factor.

        Raises:
            InputError: a factor that is not positive, or an acceleration beyond any earthquake.
        """
        if not 0.0 < factor < np.inf:
            raise InputError(f'scale {factor:g} of the ground motion must be positive')
        return replace(self, acceleration=factor * self.acceleration)

    def at(self, period: float) -> Array:
        """Return the acceleration at another period [s], linear between its samples.

        Raises:
            InputError: millions of samples.
        """
        count = round(self.duration / period) + 1
        if not 2 <= count <= _LONGEST:
            raise InputError(
                f'{self.name}: {self.duration:g} s at {1.0 / period:g} Hz are {count} samples; '
                f'2 to {_LONGEST} can be run'
            )
        times = np.arange(len(self.acceleration)) * self.period
        return np.asarray(np.interp(np.arange(count) * period, times, self.acceleration))


def artificial(seed: int, duration: float = 40.0, peak: float = 1.37) -> GroundMotion:
    """Return an artificial motion of firm ground (`model.commands.ground_acceleration`).

    Args:
        seed: same seed, same motion.
        duration: length [s].
        peak: largest acceleration; 1.37 m/s^2 is 40 % of El Centro 1940 [m/s^2].

    Raises:
        InputError: a value that cannot be used.
    """
    if seed < 0:
        raise InputError(f'seed {seed} of the ground motion is negative')
    made = ground_acceleration(_RATE, duration, peak, seed)
    return GroundMotion(made, 1.0 / _RATE, f'artificial (Kanai-Tajimi, seed {seed})')
