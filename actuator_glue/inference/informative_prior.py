"""Informative prior: a mixture of normals in the coordinates in which a posterior is sampled."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.inference.carried import Carried
from actuator_glue.inference.mixture_density import (
    Mixture,
    covariances,
    fitted,
    log_mixtures,
    sampled,
    scaled,
    with_covariances,
)
from actuator_glue.inference.transforms import Transform
from actuator_glue.inference.transforms.inverse_response import Ridge
from actuator_glue.inference.transforms.log import Log
from actuator_glue.records import Array

# Share of the draws that may lie outside the prior's box before the box contradicts them.
_OUTSIDE = 0.05
# Draws for the energy coefficient: its own scatter is then 0.001.
_COMPARED = 400


@dataclass(frozen=True, slots=True, eq=False)
class InformativePrior:
    """Prior of some of a model's parameters; the others stay uniform in their box.

    Attributes:
        names: its parameters.
        columns: their places in the model.
        transform: from its parameters to the coordinates of the mixture.
        mixture: the density of the coordinates.
        carried: the draws it was made from.
        undrifted: the density before drift and doubt widened it.
    """

    names: tuple[str, ...]
    columns: tuple[int, ...]
    transform: Transform
    mixture: Mixture
    carried: Carried
    undrifted: Mixture

    def quality(self) -> float:
        """Return the energy coefficient between the draws and the mixture fitted to them.

        0 for equal distributions, at most 1 (Szekely and Rizzo 2013). What drift adds is no fault
        of the mixture.
        """
        names = self.carried.names
        known = self.carried.draws[:, [names.index(name) for name in self.names]]
        return _energy(self.transform.forward(np.ascontiguousarray(known)), self.undrifted)

    def coordinates(self, x: Array) -> Array:
        """Return the coordinates (m, q) of the model's parameters (m, p)."""
        return self.transform.forward(np.ascontiguousarray(x[:, self.columns]))

    def log_density(self, x: Array) -> Array:
        """Return the log density (m,) of the model's parameters (m, p), per physical volume."""
        z = self.coordinates(x)
        log_jacobian = self.transform.inverse(z)[1]
        with np.errstate(invalid='ignore'):
            found = log_mixtures(self.mixture, z) - log_jacobian
        return np.where(np.isfinite(log_jacobian), found, -np.inf)

    def points(self, bounds: tuple[Array, Array], count: int, seed: Sequence[int]) -> Array:
        """Return draws of the model's prior, shape (count, p), inside its bounds."""
        rng = np.random.default_rng(tuple(seed))
        found = rng.uniform(*bounds, (count, len(bounds[0])))
        known = self.carried.points(count, rng)
        found[:, self.columns] = known[:, [self.carried.names.index(n) for n in self.names]]
        return np.clip(found, *bounds)


def informative_prior(
    carried: Carried,
    names: tuple[str, ...],
    lower: tuple[float, ...],
    upper: tuple[float, ...],
    stiffness: float | None,
) -> InformativePrior:
    """Return the prior that carried draws make for a model.

    Args:
        carried: the draws.
        names: the model's parameters; those that the draws do not know stay uniform.
        lower: lower bounds of the box, (p,).
        upper: upper bounds.
        stiffness: specimen stiffness [N/m] where one record's coordinates are to be used; None
            for logarithms.

    Raises:
        InputError: nothing is shared, or the box leaves out more than a twentieth of the draws.
    """
    as_drawn = replace(carried, spread=(), factor=1.0)
    found = _fitted(as_drawn, names, lower, upper, stiffness)
    spread = np.array([carried.spread[carried.names.index(name)] for name in found.names])
    if carried.factor == 1.0 and not spread.any():
        return found
    walked = _walked(found.mixture, found.transform, spread)
    return replace(found, carried=carried, mixture=scaled(walked, carried.factor))


def carried_coordinates(
    names: tuple[str, ...], low: Array, high: Array, stiffness: float | None
) -> Transform:
    """Return the coordinates in which what is carried of parameters is a mixture of normals.

    Args:
        names: the parameters, those of Eq. (2) first where there is a stiffness.
        low: their lower bounds (p,).
        high: their upper bounds (p,).
        stiffness: specimen stiffness of a record [N/m]; None for logarithms.
    """
    return Log(low, high) if stiffness is None else Ridge(names, low, high, stiffness)


@lru_cache(maxsize=16)
def _fitted(
    carried: Carried,
    names: tuple[str, ...],
    lower: tuple[float, ...],
    upper: tuple[float, ...],
    stiffness: float | None,
) -> InformativePrior:
    columns = tuple(i for i, name in enumerate(names) if name in carried.names)
    if not columns:
        raise InputError(f'the prior knows {", ".join(carried.names)}; the model has none of them')
    shared = tuple(names[i] for i in columns)
    low, high = np.array(lower)[list(columns)], np.array(upper)[list(columns)]
    draws = carried.draws[:, [carried.names.index(name) for name in shared]]
    inside = ((draws >= low) & (draws <= high)).all(axis=1)
    if inside.mean() < 1.0 - _OUTSIDE:
        beyond = [
            name
            for name, column, a, b in zip(shared, draws.T, low, high, strict=True)
            if ((column < a) | (column > b)).mean() > 0.5 * _OUTSIDE / len(shared)
        ]
        raise InputError(
            f'{1.0 - inside.mean():.0%} of the carried draws lie outside the bounds of '
            f'{", ".join(beyond)}; widen the bounds or calibrate anew'
        )
    draws = np.ascontiguousarray(draws[inside])
    ridged = stiffness is not None and shared[:4] == names[:4] and len(shared) >= 4
    transform = carried_coordinates(shared, low, high, stiffness if ridged else None)
    mixture = fitted(transform.forward(draws), carried.components)
    return InformativePrior(shared, columns, transform, mixture, carried, mixture)


def _walked(mixture: Mixture, transform: Transform, spread: Array) -> Mixture:
    """Return a mixture after a random walk of the parameters' logarithms by `spread` (p,)."""
    middles = transform.inverse(mixture.means)[0]
    # Secants over one standard deviation: the transform is smooth on that scale.
    far = np.exp(np.diag(spread))
    above = [transform.forward(np.ascontiguousarray(m * far)) for m in middles]
    below = [transform.forward(np.ascontiguousarray(m / far)) for m in middles]
    steps = 0.5 * (np.array(above) - np.array(below))
    return with_covariances(
        mixture, covariances(mixture) + np.einsum('kja,kjb->kab', steps, steps)
    )


def _energy(z: Array, mixture: Mixture) -> float:
    """Return the energy coefficient between coordinates (m, p) and draws of the mixture."""
    from scipy.spatial.distance import cdist

    rng = np.random.default_rng(len(z))
    scale = np.maximum(z.std(axis=0), 1e-300)
    ours = z[:: max(1, len(z) // _COMPARED)][:_COMPARED] / scale
    theirs = sampled(mixture, len(ours), rng) / scale
    between = 2.0 * cdist(ours, theirs).mean()
    # Without the zeros of a point's distance to itself, equal distributions give 0 on average.
    share = len(ours) / (len(ours) - 1.0)
    within = share * (cdist(ours, ours).mean() + cdist(theirs, theirs).mean())
    return float(max(between - within, 0.0) / between)
