"""The model that is fitted, and the uniform prior's box."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.inference.likelihood import PHI
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array


@dataclass(frozen=True, slots=True)
class ModelChoice:
    """The model that is fitted: Eq. (2) with effects, and the uniform prior's box.

    Attributes:
        effects: names of the catalogue; empty for Eq. (2) itself.
        names: the model's parameters.
        units: their units.
        lower: lower bounds of the prior.
        upper: upper bounds of the prior.
        start: where to start sampling; NaN or empty for anywhere in the prior.
    """

    effects: tuple[str, ...]
    names: tuple[str, ...]
    units: tuple[str, ...]
    lower: tuple[float, ...]
    upper: tuple[float, ...]
    # Not compared: NaN differs from itself once it has been through a pipe, and where sampling
    # once began makes no other model.
    start: tuple[float, ...] = field(default=(), compare=False)

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds, each of shape (p,)."""
        return np.array(self.lower), np.array(self.upper)

    def with_autocorrelation(self) -> ModelChoice:
        """Return the choice with the errors' autocorrelation as its last parameter."""
        return replace(
            self,
            names=(*self.names, PHI.name),
            units=(*self.units, PHI.unit),
            lower=(*self.lower, PHI.lower),
            upper=(*self.upper, PHI.upper),
        )


def choose_model(
    effects: Sequence[str] = (),
    bounds: Mapping[str, tuple[float, float]] | None = None,
    start: Mapping[str, float] | None = None,
) -> ModelChoice:
    """Return Eq. (2) with effects of the catalogue, and the prior's box.

    Args:
        effects: names of the catalogue.
        bounds: lower and upper bounds that replace those of Table 3 and the catalogue.
        start: where to start sampling, by parameter.

    Raises:
        InputError: unknown effect or parameter, or bounds that leave nothing between them.
    """
    structure = Structure(tuple(effects))
    parameters = structure.parameters
    names = tuple(p.name for p in parameters)
    for given in (bounds or {}, start or {}):
        unknown = sorted(set(given) - set(names))
        if unknown:
            raise InputError(f'the model has no parameters {unknown}; it has {list(names)}')
    box = {p.name: (p.lower, p.upper) for p in parameters} | dict(bounds or {})
    for name, (lower, upper) in box.items():
        if not (np.isfinite([lower, upper]).all() and lower < upper):
            raise InputError(f'bounds of {name} are [{lower:g}, {upper:g}]; lower must be below')
    places: tuple[float, ...] = ()
    if start:
        places = tuple(float(start.get(name, np.nan)) for name in names)
        for name, value in zip(names, places, strict=True):
            if not np.isnan(value) and not box[name][0] <= value <= box[name][1]:
                raise InputError(f'start of {name} is {value:g}, outside its bounds')
    return ModelChoice(
        effects=tuple(effects),
        names=names,
        units=tuple(p.unit for p in parameters),
        lower=tuple(box[name][0] for name in names),
        upper=tuple(box[name][1] for name in names),
        start=places,
    )
