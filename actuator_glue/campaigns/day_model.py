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
# Walk per root of a day, and offset of a day: log-uniform from values that do not matter to values
# that no machine has.
_WALKS = np.geomspace(1e-5, 0.03, 12)
_OFFSETS = np.geomspace(1e-4, 0.5, 20)
# Values of each in a finer grid, and log likelihood below the likeliest pair's that is negligible.
_FINE = 24
_NEGLIGIBLE = 7.0


@dataclass(frozen=True, slots=True, eq=False)
class Grid:
    """Values of the walk and of the offset, every pair of them, (g,)."""

    walk: Array
    offset: Array

    @classmethod
    def usual(cls) -> Grid:
        """Return the grid that every parameter has."""
        return cls.of(_WALKS, _OFFSETS)

    @classmethod
    def of(cls, walks: Array, offsets: Array) -> Grid:
        """Return every pair of some walks and offsets."""
        walk, offset = np.meshgrid(walks, offsets, indexing='ij')
        return cls(walk.ravel(), offset.ravel())

    def reference(self, s: Array) -> Array:
        """Return the log density of tau's reference prior over that of the grid, (g,).

        Log-uniform where the days scatter by more than tests know, falling off as tau^2 below: a
        log-uniform prior alone has most of tau where it does not matter, and what few days tell
        too narrow. It is Jeffreys' prior of random effects (Bodnar et al. 2017).

        Args:
            s: standard deviations of the tests, (n,).
        """
        share = self.offset[:, None] ** 2 / (self.offset[:, None] ** 2 + s**2)
        return np.asarray(0.5 * np.log((share**2).sum(axis=1)))

    def around(self, log_likelihood: Array) -> Grid:
        """Return a finer grid around the posterior, which many days make narrower than this grid.

        Args:
            log_likelihood: of each pair, (g,).
        """
        there = log_likelihood > log_likelihood.max() - _NEGLIGIBLE
        finer = []
        for all_values, values in ((_WALKS, self.walk), (_OFFSETS, self.offset)):
            # A step beyond what counts on either side, within the prior.
            step = all_values[1] / all_values[0]
            low = max(values[there].min() / step, all_values[0])
            high = min(values[there].max() * step, all_values[-1])
            finer.append(np.geomspace(low, high, _FINE))
        return Grid.of(*finer)


def log_likelihoods(
    times: Array,
    y: Array,
    s: Array,
    jumps: Collection[int] = (),
    also: Sequence[int] = (),
    grid: Grid | None = None,
) -> Array:
    """Return the log likelihood of the days for each pair of the grid.

    Args:
        times: days, (n,).
        y: estimates, (n,).
        s: their standard deviations, (n,).
        jumps: places before which the level jumps.
        also: one more place, for each of m hypotheses, ascending, (m,).
        grid: of walks and offsets; None for the usual one.

    Returns:
        Shape (1 + m, g): without one more place, and with each.
    """
    grid = grid or Grid.usual()
    shape = (1 + len(also), len(grid.walk))
    m, p, total = np.zeros(shape), np.full(shape, DIFFUSE**2), np.zeros(shape)
    begun = 1  # before its place a hypothesis is as the first row
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


def walked(times: Array, weights: Array) -> float:
    """Return the variance of a weighted sum of levels, for a walk of 1 in a root of a day.

    A step of the walk moves the levels of all later days alike, so that it counts with the sum of
    their weights: the days between for two single days, less for stretches that are near.

    Args:
        times: days, ascending, (n,).
        weights: of each day's level, (n,); their sum is zero, as for the difference of two means.

    Returns:
        Days: the variance over q^2.
    """
    later = np.cumsum(weights[::-1])[::-1][1:]
    return float((np.diff(times) * later**2).sum())


def hyper_draws(
    times: Array,
    y: Array,
    s: Array,
    jumps: Collection[int],
    count: int,
    rng: np.random.Generator,
) -> tuple[Array, Array]:
    """Return draws (count,) of walk and offset from their posterior.

    Args:
        times: days, (n,).
        y: estimates, (n,).
        s: their standard deviations, (n,).
        jumps: places before which the level jumps.
        count: how many.
        rng: random numbers.
    """
    grid = Grid.usual().around(log_likelihoods(times, y, s, jumps)[0])
    density = log_likelihoods(times, y, s, jumps, grid=grid)[0] + grid.reference(s)
    weights = np.exp(density - density.max())
    # Strata: as many draws of each pair as its weight says, but for one.
    at = (np.arange(count) + rng.random(count)) / count
    rows = np.searchsorted(np.cumsum(weights) / weights.sum(), at).clip(max=len(weights) - 1)
    rows = rng.permutation(rows)
    return grid.walk[rows], grid.offset[rows]
