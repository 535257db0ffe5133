"""The model of a window: simulated responses, starting points, identifiability."""

from __future__ import annotations

import numpy as np

from actuator_glue.inference.choice import ModelChoice
from actuator_glue.model import linear
from actuator_glue.model.effects.layout import LANES
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array, Record


def simulate(model: ModelChoice, theta: Array, record: Record, first: int = 0) -> Array:
    """Return the response of each draw (m, p) from sample `first` of a window on, (m, n) [m]."""
    if model.effects:
        response = Structure(model.effects).simulate(
            theta, record, initial='measured', origin=record.first_index * record.period
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


def batch(wanted: int) -> int:
    """Return the number of parameter sets in full simulation batches, `wanted` or more."""
    return -(-wanted // LANES) * LANES


def starting_points(
    model: ModelChoice, before: tuple[str, ...], archive: Array, seed: tuple[int, ...]
) -> Array | None:
    """Return points to start from after the model changed, shape (m, p).

    Parameters that are in `before`, the archive's columns, keep their values; new ones are spread
    around their starting value by a tenth of it, or over the prior. None where nothing is shared.
    """
    if model.names == before:
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
        if name in before:
            points[:, j] = archive[:, before.index(name)]
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
