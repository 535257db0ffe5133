"""What a sensor makes of a true signal: white noise and quantisation, seeded, streaming."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.records import Array


@dataclass(frozen=True, slots=True)
class SensorSpec:
    """A sensor's imperfections, in the unit of what it measures.

    Attributes:
        noise: standard deviation of white noise.
        bits: resolution of the converter over -span..span, None for none; clips beyond.
        span: full scale of the converter.

    Raises:
        InputError: negative or not finite noise, bits outside 1..52, span not positive.
    """

    noise: float = 0.0
    bits: int | None = None
    span: float = 1.0

    def __post_init__(self) -> None:
        if not (np.isfinite(self.noise) and self.noise >= 0.0):
            raise InputError(f'sensor noise {self.noise:g} is negative or not finite')
        if self.bits is not None and not 1 <= self.bits <= 52:
            raise InputError(f'{self.bits} bits of resolution; use 1 to 52')
        if not (np.isfinite(self.span) and self.span > 0.0):
            raise InputError(f'sensor span {self.span:g} must be positive')

    @property
    def resolution(self) -> float:
        """Step between neighbouring values, 0 without quantisation."""
        return 0.0 if self.bits is None else 2.0 * self.span / 2**self.bits


class Sensor:
    """One sensor with its own noise stream; the output does not depend on the block size."""

    def __init__(self, spec: SensorSpec, seed: int | np.random.SeedSequence = 0) -> None:
        self.spec = spec
        self._seed = seed
        self.reset()

    def reset(self) -> None:
        """Start the noise stream anew."""
        self._rng = np.random.default_rng(self._seed)

    def measure(self, true: Array) -> Array:
        """Return what the sensor shows for a block of true values, shape (n,)."""
        spec = self.spec
        shown = true
        if spec.noise > 0.0:
            shown = shown + spec.noise * self._rng.standard_normal(len(true))
        if spec.bits is not None:
            top = 2 ** (spec.bits - 1)
            shown = np.clip(np.round(shown / spec.resolution), -top, top - 1) * spec.resolution
        return shown
