"""The model behind a window: choose it, its errors over the window, its simulated responses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.inference.likelihood import Errors
from actuator_glue.model import linear
from actuator_glue.model.effects.rows import LANES
from actuator_glue.model.fast import FastErrors
from actuator_glue.model.structure import Structure
from actuator_glue.online.settings import ModelChoice
from actuator_glue.records import Array, Record


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


def errors(model: ModelChoice, record: Record, settle: int, near: Array | None = None) -> Errors:
    """Return the error sums of a window, started from its first measured samples.

    Args:
        model: the model.
        record: the window.
        settle: samples that only let the initial state be forgotten.
        near: parameters (p,) near the best fit, where known; they save time and change nothing.
    """
    if not model.effects:
        return FastErrors([record], settle, 'measured', near=near)
    return Structure(model.effects).errors(
        [record], settle=settle, initial='measured', origin=_origin(record)
    )


def simulate(model: ModelChoice, theta: Array, record: Record, first: int = 0) -> Array:
    """Return the response of each draw (m, p) from sample `first` of a window on, (m, n) [m]."""
    if model.effects:
        response = Structure(model.effects).simulate(
            theta, record, initial='measured', origin=_origin(record)
        )
        return response[:, first:]
    return linear.simulate(
        theta,
        record.command,
        stiffness=record.known_stiffness(),
        period=record.period,
        hold=record.hold,
        initial=linear.initial_state(record),
        first=first,
    )


def _origin(record: Record) -> float:
    """Time of a window's first sample since the test began [s]: what drifts did so from there."""
    return record.first_index * record.period


def batch(wanted: int) -> int:
    """Return how many parameter sets, `wanted` or more, a model with effects simulates at once."""
    return -(-wanted // LANES) * LANES


def starting_points(
    model: ModelChoice, before: ModelChoice, archive: Array, seed: tuple[int, ...]
) -> Array | None:
    """Return points to start from after the model changed, shape (m, p).

    Parameters both models have keep their values; new ones are spread around their starting
    value by a tenth of it, or over the prior. None where nothing is shared.
    """
    if model.names == before.names:
        return np.clip(archive, *model.bounds)
    rng = np.random.default_rng(seed)
    lower, upper = model.bounds
    points = rng.uniform(lower, upper, (len(archive), len(lower)))
    for j, start in enumerate(model.start):
        if not np.isnan(start):
            width = upper[j] - lower[j]
            spread = 0.1 * min(max(abs(start), 1e-3 * width), width)
            points[:, j] = start + spread * rng.uniform(-1.0, 1.0, len(points))
    for j, name in enumerate(model.names):
        if name in before.names:
            points[:, j] = archive[:, before.names.index(name)]
    return np.clip(points, lower, upper)


def identifiable(stiffness: float) -> str:
    """Return what one record at a specimen stiffness [N/m] can identify, in words.

    Eq. (2b) holds beta_1 and alpha_1 beta_0/alpha_2 only; Eq. (2a) at one k > 0 has three
    coefficients for four parameters.
    """
    if stiffness == 0.0:
        return (
            'k = 0 identifies beta_1 and alpha_1_beta_0/alpha_2 only; alpha_1_beta_0 and alpha_2 '
            'by themselves, and alpha_3, keep their prior'
        )
    return (
        f'one stiffness, k = {stiffness:g} N/m, identifies three combinations of the four '
        'parameters; alpha_1_beta_0 and alpha_2 trade off against each other'
    )


__all__ = ['batch', 'choose_model', 'errors', 'identifiable', 'simulate', 'starting_points']
