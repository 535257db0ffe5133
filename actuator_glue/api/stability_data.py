"""What `rths` found: how likely a hybrid test is unstable with a calibrated actuator."""

from __future__ import annotations

from dataclasses import dataclass

from actuator_glue.api.spread import Spread
from actuator_glue.api.virtual_test import VirtualResult
from actuator_glue.errors import InputError
from actuator_glue.given import number
from actuator_glue.hybrid.margin import Margins
from actuator_glue.hybrid.stability import Share
from actuator_glue.records import Array


def limit_given(limit: float) -> float:
    """Return the largest P(unstable) that is accepted.

    Raises:
        InputError: it is no probability, as 5 for 5 %.
    """
    limit = number(limit, 'limit')
    if not 0.0 <= limit <= 1.0:
        raise InputError(f'limit {limit:g}: a probability lies between 0 and 1; 5 % is 0.05')
    return limit


@dataclass(frozen=True, slots=True)
class AtFrequency:
    """How the actuator follows a sine, before any compensation.

    Attributes:
        frequency_hz: of the sine.
        delay_s: phase lag over angular frequency.
        amplitude: measured over commanded.
    """

    frequency_hz: float
    delay_s: Spread
    amplitude: Spread


@dataclass(frozen=True, slots=True)
class DelayMargin:
    """tau_c of the loop with a pure delay for an actuator [s]; infinite where none limits it.

    Attributes:
        pure_delay: in continuous time.
        sampled: with the force held from sample to sample and the computation delay spent.
    """

    pure_delay: float
    sampled: float


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class StabilityData:
    """Stability of a hybrid test over the draws of a posterior.

    Attributes:
        partition: its name.
        natural_frequencies_hz: of the whole structure, ascending.
        rate_hz: sample rate of the loop.
        delay_margin: without an actuator, by its pure delay.
        margins: gain and phase margin of the same loop, and with the mean actuator.
        p_unstable: share of draws that are unstable. Where a virtual test tells, its upper limit
            counts draws, too, that are unstable without the nonlinear effects but grow too slowly
            to diverge in its time.
        unstable_by: how that is told: by 'characteristic roots' in the right half plane; or by
            the 'virtual test', where the model is not linear or the compensator adapts.
        margin_s: further delay that the draws can bear; negative for unstable ones, where it is
            minus the smallest lead that reaches the stability limit; None where nothing limits.
        growth_per_s: real part of the rightmost characteristic root of the sampled loop.
        bandwidth_hz: where the actuator is 3 dB below its static gain.
        tracking: delay and amplitude at the frequencies asked for.
        sensitivity: rank correlation of the margin with each parameter.
        most_sensitive: the parameter of the largest one; None where the margin does not vary.
        effect_cost_s: how much of the margin each effect of the model costs, nonlinear ones under
            the ground motion; of those with a limit with and without it.
        compensator: 'none', or what it is.
        virtual: what the draws did under a ground motion; None where none was given.
        draws: how many were used.
        seed: of the specimen's draws and the sensors' noise.
        seconds: how long it took.
        problems: why the posterior must not be used as it stands.
        notes: what limits the answer.
        margins_drawn, growth_drawn: of each draw, (draws,).
    """

    partition: str
    natural_frequencies_hz: tuple[float, ...]
    rate_hz: float
    delay_margin: DelayMargin
    margins: dict[str, Margins]
    p_unstable: Share
    unstable_by: str
    margin_s: Spread | None
    growth_per_s: Spread
    bandwidth_hz: Spread
    tracking: tuple[AtFrequency, ...]
    sensitivity: dict[str, float]
    most_sensitive: str | None
    effect_cost_s: dict[str, Spread]
    compensator: str
    virtual: VirtualResult | None
    draws: int
    seconds: float
    problems: tuple[str, ...]
    notes: tuple[str, ...]
    margins_drawn: Array
    growth_drawn: Array
    seed: int = 1

    def go(self, limit: float) -> bool:
        """Whether P(unstable) is at most a limit up to its upper bound, by a usable posterior.

        Raises:
            InputError: the limit is no probability.
        """
        return self.p_unstable.upper <= limit_given(limit) and not self.problems

    def summary(self) -> str:
        """Return P(unstable) with its interval in one line."""
        p = self.p_unstable
        return (
            f'P(unstable) = {p.value:.4g} ({100 * p.level:g} % interval {p.lower:.3g} to '
            f'{p.upper:.3g}, {self.draws} draws worth {p.effective_draws:.0f} independent ones)'
        )
