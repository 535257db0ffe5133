"""The result of `rths`: the stability of a hybrid test, with its files and pictures."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, ClassVar

from actuator_glue.api.result import Result
from actuator_glue.api.stability_data import StabilityData
from actuator_glue.hybrid.margin import psi

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from actuator_glue.report import html


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class StabilityResult(Result, StabilityData):
    """Stability of a hybrid test over the draws of a posterior.

    Its numbers are those of `StabilityData`: `p_unstable`, `margin_s`, `virtual`, ...
    """

    schema: ClassVar[str] = 'actuator_glue.rths/1'

    def to_json(self) -> dict[str, Any]:
        """Return the object of schema `actuator_glue.rths/1`."""
        margin = self.delay_margin
        return {
            'schema': self.schema,
            'partition': self.partition,
            'natural_frequencies_hz': list(self.natural_frequencies_hz),
            'rate_hz': self.rate_hz,
            'delay_margin_s': asdict(margin),
            'psi': {'pure_delay': psi(margin.pure_delay), 'sampled': psi(margin.sampled)},
            'margins': {name: asdict(m) for name, m in self.margins.items()},
            'p_unstable': asdict(self.p_unstable),
            'unstable_by': self.unstable_by,
            'indicators': {
                'margin_s': None if self.margin_s is None else asdict(self.margin_s),
                'growth_per_s': asdict(self.growth_per_s),
                'bandwidth_hz': asdict(self.bandwidth_hz),
                'tracking': [asdict(t) for t in self.tracking],
                'sensitivity': self.sensitivity,
                'effect_cost_s': {n: asdict(s) for n, s in self.effect_cost_s.items()},
                'most_sensitive': self.most_sensitive,
                **({} if self.virtual is None else self.virtual.to_json()['indicators']),
            },
            'virtual_test': None if self.virtual is None else self.virtual.to_json(),
            'compensator': self.compensator,
            'draws': self.draws,
            'seed': self.seed,
            'seconds': self.seconds,
            'problems': list(self.problems),
            'notes': list(self.notes),
        }

    def plot(self) -> Figure:
        """Return a figure of the margins and the growth rates of the draws."""
        from actuator_glue.api.stability_report import stability_figure

        return stability_figure(self)

    def brief(self) -> list[html.Block]:
        """Return problems, summary, the distributions over the draws and notes."""
        from actuator_glue.api.stability_report import brief

        return brief(self)

    def page(self) -> html.Page:
        """Return the report."""
        from actuator_glue.api.stability_report import page

        return page(self)
