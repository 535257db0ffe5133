"""What an effect does in the compiled step: njit functions, each for one lane n of the table w."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple, TypeAlias

from actuator_glue.model.effects import layout as r


class Case(NamedTuple):
    """What a table is filled for.

    Attributes:
        k: specimen stiffness [N/m].
        step: sub-step [s].
        period: sample period [s].
        x: position at the first sample [m].
        v: velocity there [m/s].
    """

    k: float
    step: float
    period: float
    x: float
    v: float


# Quantities of the scheme that effects add to: gain of the command (a factor), its delay [s] and
# the skew of its clock, control error [m], second time constant of the valve [s], damping [N s/m],
# mass [kg], dry friction [N].
Quantity: TypeAlias = Literal[
    'gain', 'delay', 'skew', 'error', 'valve_lag', 'damping', 'mass', 'dry'
]


@dataclass(frozen=True, slots=True)
class Stage:
    """What an effect does in the compiled step; of one place in the order of the effects' names.

    Attributes:
        fill: (w, n, p, case): writes the effect's own rows, coefficients and states at the first
            sample, from parameters p by name.
        adds: (p) -> what the effect adds to a quantity of the scheme.
        error: (w, n, e, slope) -> the same after the effect, of the control error and its d/d(dx),
            which it may only keep or make zero.
        gain: (w, n, time) -> factor of the flow; needs a switch of its own.
        limit: (w, n, flow, slope) -> the same after the effect, of the flow times all gains.
        beyond: (w, n) -> what the controller's own transducer shows beyond the position, in the
            middle of the step to come; called once before every step.
        sensed: (w, n, y) -> recorded displacement.
        own: switch that the effect has taken for itself (layout.SWITCHES).
        shared: switches of the scheme that it needs (layout.ON_...), beside that of its place.
    """

    fill: Callable[..., None] | None = None
    adds: Mapping[Quantity, Callable[[Any], Any]] = field(default_factory=dict)
    error: Callable[..., Any] | None = None
    gain: Callable[..., Any] | None = None
    limit: Callable[..., Any] | None = None
    beyond: Callable[..., Any] | None = None
    sensed: Callable[..., Any] | None = None
    own: int | None = None
    shared: tuple[int, ...] = ()

    @property
    def switches(self) -> list[int]:
        """Which stages of the kernel act."""
        on = [*self.shared, *([] if self.own is None else [self.own])]
        if self.gain is not None or self.limit is not None:
            on.append(r.ON_FLOW)
        if self.sensed is not None:
            on.append(r.ON_TRANSDUCER)
        return on
