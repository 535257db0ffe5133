"""What is known seconds after the start: what Eq. (2) leaves, and whether anything is missing."""

from __future__ import annotations

from dataclasses import dataclass

from actuator_glue.diagnosis.score.scorer import structure_and_noise
from actuator_glue.diagnosis.thresholds import least_material
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.inference.least_squares.fit import Fit
from actuator_glue.json_value import JsonObject
from actuator_glue.model.effects import scale


@dataclass(frozen=True, slots=True)
class FirstLook(JsonObject):
    """Eq. (2) refitted to the fitting part, or to stretches of it for long records.

    Attributes:
        error_m: rms of its residual [m].
        noise_m: rms of the noise in it [m].
        structure_m: rms of the rest, which is no noise [m].
        matters_m: least structure that matters [m].
    """

    error_m: float
    noise_m: float
    structure_m: float
    matters_m: float

    @classmethod
    def of(cls, data: Data, fit: Fit) -> FirstLook:
        """Split the residual of a fit of Eq. (2) into noise and structure."""
        structure, noise = structure_and_noise(data, fit.error)
        matters = least_material(noise, scale(data.records, fit.theta).stroke)
        return cls(fit.rms, noise, structure, matters)

    @property
    def missing(self) -> bool:
        """Whether more than noise shows; structure that passes for noise is found later."""
        return self.structure_m >= self.matters_m

    def sentence(self) -> str:
        """Say it in one line."""
        sizes = f'{1e6 * self.error_m:.1f} um over {1e6 * self.noise_m:.1f} um of noise'
        if self.missing:
            return f'Eq. (2) leaves {sizes}: more than noise, looking for what it is'
        return f'Eq. (2) leaves {sizes}: nothing that matters shows yet'
