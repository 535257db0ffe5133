"""An earlier calibration taken as a prior: where it came from, and how it stood up to records."""

from __future__ import annotations

from dataclasses import dataclass

from actuator_glue.inference.carried import Carried
from actuator_glue.records import Array

# Prior predictive p-value below which records and prior do not belong together.
CONTRADICTED = 1e-3
# Energy coefficient of a mixture that describes its draws poorly: one of four parameters shifted
# by half a standard deviation gives 0.013, by a whole one 0.056.
POOR = 0.02


@dataclass(frozen=True, slots=True)
class PriorUse:
    """The informative prior of a calibration or a diagnosis, and how it stood up to the records.

    Attributes:
        source: the calibration it came from.
        drift: standard deviation of the logarithm of a parameter after an hour [h^-1/2].
        age_s: time since that calibration [s].
        components: normal components it has.
        quality: energy coefficient between its draws and the mixture, 0 for equal.
        p_value: prior predictive p-value of the records (Evans and Moshonov 2006).
        doubt: structure over noise that the calibration left, where its intervals do not hold.
        names: parameters that it knew.
    """

    source: str
    drift: float
    age_s: float
    components: int
    quality: float
    p_value: float
    doubt: str = ''
    names: tuple[str, ...] = ()

    @property
    def contradicted(self) -> bool:
        """Whether the records contradict it."""
        return self.p_value < CONTRADICTED

    def contradiction(self) -> str:
        """Return what to do where they do."""
        return (
            f'the records contradict the prior from {self.source} (p = {self.p_value:.2g}): the '
            'actuator has changed, or a model lacks something; go without it, or allow for '
            'more --drift'
        )

    def remark(self) -> str:
        """Return how it was used, in one line."""
        return (
            f'prior from {self.source}: a mixture of {self.components} normal(s), '
            f'energy coefficient {self.quality:.3f} against its draws'
            + (f'; above {POOR}, so it describes them poorly' if self.quality > POOR else '')
            + f'; prior predictive p-value of the records {self.p_value:.2g}'
            + (f'; it left {self.doubt}: its intervals do not hold' if self.doubt else '')
        )


@dataclass(frozen=True, slots=True, eq=False)
class GivenPrior:
    """What is known now of an actuator that was calibrated before.

    Attributes:
        carried: draws, drifted to the time of the records.
        source, drift, age_s, doubt: as in `PriorUse`.
        sketches: of the records it was made of, as in `hygiene.repeats`; empty where not known.
    """

    carried: Carried
    source: str
    drift: float
    age_s: float
    doubt: str = ''
    sketches: tuple[Array, ...] = ()

    def used(self, components: int, quality: float, p_value: float) -> PriorUse:
        """Return how it was used."""
        return PriorUse(
            self.source,
            self.drift,
            self.age_s,
            components,
            quality,
            p_value,
            self.doubt,
            self.carried.names,
        )
