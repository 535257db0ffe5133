"""One parameter over the days: a level that walks, an offset of each day, what a test knows.

    y_t = level_t + offset_t + e_t,  level_t ~ N(level_(t-1), q^2 dt),  offset_t ~ N(0, tau^2),
    e_t ~ N(0, s_t^2),  level_(t+) ~ N(level_t, jump^2) where the actuator was changed

y is the logarithm of the parameter in one test, s its posterior standard deviation there: the
second stage of a two-stage meta-analysis (Burke et al. 2017) with the random-walk level of a local
level model (Durbin and Koopman 2012). q and tau are unknown: a grid holds their posterior.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from actuator_glue.records import Array

# Standard deviation of the logarithm before the first test: nothing is known.
DIFFUSE = 10.0
# Of what a repair or a fault does to the logarithm of a parameter.
JUMP = 0.3
# Walk per root of a day, and offset of a day: log-uniform between what does not matter and what
# no machine does.
_WALKS = np.geomspace(1e-5, 0.03, 12)
_OFFSETS = np.geomspace(1e-4, 0.5, 20)


@dataclass(frozen=True, slots=True, eq=False)
class Grid:
    """Values of the walk and of the offset, every pair of them, (g,)."""

    walk: Array
    offset: Array

    @classmethod
    def usual(cls) -> Grid:
        """Return the grid that every parameter has."""
        walk, offset = np.meshgrid(_WALKS, _OFFSETS, indexing='ij')
        return cls(walk.ravel(), offset.ravel())


def log_likelihoods(
    times: Array, y: Array, s: Array, jumps: Collection[int] = (), also: Sequence[int] = ()
) -> Array:
    """Return the log likelihood of the days for each pair of the grid.

    Args:
        times: days, (n,).
        y: estimates, (n,).
        s: their standard deviations, (n,).
        jumps: places before which the level jumps.
        also: one more place, for each of m hypotheses, ascending, (m,).

    Returns:
        Shape (1 + m, g): without one more place, and with each.
    """
    grid = Grid.usual()
    shape = (1 + len(also), len(grid.walk))
    m, p, total = np.zeros(shape), np.full(shape, DIFFUSE**2), np.zeros(shape)
    begun = 1  # until its place a hypothesis is as the first row
    for t in range(len(y)):
        if t:
            p[:begun] += grid.walk**2 * (times[t] - times[t - 1]) + JUMP**2 * (t in jumps)
        while begun <= len(also) and also[begun - 1] == t:
            m[begun], p[begun], total[begun] = m[0], p[0] + JUMP**2, total[0]
            begun += 1
        f = p[:begun] + grid.offset**2 + s[t] ** 2
        v = y[t] - m[:begun]
        total[:begun] -= 0.5 * (np.log(2.0 * np.pi * f) + v**2 / f)
        gain = p[:begun] / f
        m[:begun] += gain * v
        p[:begun] *= 1.0 - gain
    return total


def hyper_draws(
    log_likelihood: Array, count: int, rng: np.random.Generator
) -> tuple[Array, Array]:
    """Return draws (count,) of walk and offset from their posterior over the grid, (g,)."""
    grid = Grid.usual()
    weights = np.exp(log_likelihood - log_likelihood.max())
    # Strata: as many draws of each pair as its weight says, but for one.
    at = (np.arange(count) + rng.random(count)) / count
    rows = np.searchsorted(np.cumsum(weights) / weights.sum(), at).clip(max=len(weights) - 1)
    rows = rng.permutation(rows)
    return grid.walk[rows], grid.offset[rows]
