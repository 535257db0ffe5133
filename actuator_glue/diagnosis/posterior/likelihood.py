"""The likelihood of a structure's parameters, whitened, and its optimum.

Least squares of the whitened error, with an allowance for effects too small to matter.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import NamedTuple

import numpy as np
import scipy

from actuator_glue.diagnosis.posterior.discrepancy import Discrepancy, ScaleMixture
from actuator_glue.diagnosis.posterior.identifiable import Straight, Working, derivatives
from actuator_glue.diagnosis.score.scorer import Scorer, standard_error
from actuator_glue.inference.least_squares.data import LANES, Data, lanes
from actuator_glue.inference.least_squares.each import Each
from actuator_glue.inference.least_squares.fit import Fit
from actuator_glue.inference.least_squares.fit import fit as fit_to
from actuator_glue.inference.least_squares.free_run import Model
from actuator_glue.inference.least_squares.space import Space, diverged
from actuator_glue.records import Array

_STEPS = 8  # from the least-squares fit to the optimum of the likelihood
# From the optimum of the whitened error to that of the likelihood: a step that gains less ends
# the search.
_NATS, _MOST_STEPS = 0.5, 20
# Lengths of a step that are tried, all at the same time.
_LENGTHS = 0.5 ** np.arange(LANES)
_SURE = 2.0  # standard errors over the blocks


class Optimum(NamedTuple):
    """An optimum of a likelihood.

    Attributes:
        centre: coordinates (p,) around which the response is taken as linear.
        moves: distribution of the coordinates' distance from there, under a linear response.
        height: log density at the centre, the prior of the coordinates included.
    """

    centre: Array
    moves: ScaleMixture
    height: float

    def log_mass(self) -> float:
        """Logarithm of its posterior mass under a linear response, up to a constant."""
        return self.height + 0.5 * float(np.linalg.slogdet(self.moves.moments()[1])[1])

    def is_about(self, other: Optimum) -> bool:
        """Return whether it is within a standard deviation of another one."""
        off = self.centre - other.centre
        return bool(off @ np.linalg.pinv(self.moves.moments()[1]) @ off < 1.0)


@dataclass(frozen=True)
class Whitened(Data):
    """The same samples, whitened: their least-squares fit is the most likely one."""

    scorer: Scorer = field(kw_only=True)

    @cached_property
    def target(self) -> Array:
        """As `Data.target`, whitened."""
        pairs = zip(self.records, self.masks, strict=True)
        return self.scorer.whiten(np.concatenate([r.measured[mask] for r, mask in pairs]))

    def simulate(self, model: Model, theta: Array, each: Each | None = None) -> Array:
        """As `Data.simulate`, whitened."""
        return self.scorer.whiten(super().simulate(model, theta, each))


def most_likely(data: Data, model: Model, theta: Array, scorer: Scorer) -> Fit:
    """Return the optimum of the likelihood that is sampled, starting from parameters (p,).

    The least-squares optimum is up to 12 nats from it under slow noise, and the likelihood's
    covariance belongs to its own optimum. Simulations and comparisons keep the least-squares fit:
    where structure remains, its plain error is smaller. Error and Jacobian of the returned fit are
    whitened.
    """
    white = Whitened(**{f.name: getattr(data, f.name) for f in fields(Data)}, scorer=scorer)
    return fit_to(white, model, theta, iterations=_STEPS)


@dataclass(frozen=True)
class Likelihood:
    """Likelihood of parameters, and its optimum under a locally linear response.

    Attributes:
        model: the structure.
        scorer: the samples, and whitening filters of their noise.
        beside: discrepancy of small effects that the structure lacks.
        noise: variance of the whitened noise.
        space: working coordinates.
        around: the coordinates in which it is nearly normal.
        each: evaluates some parameters at a time: `map`, or that of a pool of threads.
    """

    model: Model
    scorer: Scorer
    beside: Discrepancy
    noise: float
    space: Space
    around: Working | Straight
    each: Each = map

    @cached_property
    def _whitened(self) -> Array:
        return self.scorer.whiten(self.scorer.data.target)

    def __call__(self, theta: Array) -> Array:
        """Log density (m,) of parameters (m, p), with that of the prior where one was given.

        Otherwise the prior is uniform in the logarithms.
        """
        data = self.scorer.data
        parts = [theta[some] for some in lanes(len(theta))]
        found = np.concatenate(list(self.each(self._of_some, parts)))
        return found if data.prior is None else found + data.prior.log_density(theta)

    def _of_some(self, theta: Array) -> Array:
        error = self.scorer.data.simulate(self.model, theta)
        with np.errstate(all='ignore'):
            error = self.scorer.whiten(np.subtract(self.scorer.data.target, error, out=error))
            return self.beside.log_likelihood(error, self.noise)

    def _response(self, theta: Array) -> Array:
        data = self.scorer.data
        found = self.scorer.whiten(data.simulate(self.model, theta))
        if data.prior is None:
            return found
        pull = math.sqrt(self.noise) * data.prior.pull(self.space.z(theta))
        return np.hstack([found, pull])

    def _heights(self, phi: Array) -> Array:
        """Log densities (m,) at coordinates (m, p), the prior of the coordinates included."""
        theta, heights = self.around.inverse(phi)
        inside = np.isfinite(heights)
        if inside.any():
            heights[inside] += self(theta[inside])
        return heights

    def _moves(self, phi: Array) -> ScaleMixture:
        """Distribution of the parameters' distance from coordinates (p,), if all is linear."""
        seen, jac = derivatives(self.around, self.space, phi, self._response)
        white = self._whitened
        error = np.concatenate([white, np.zeros(len(seen) - len(white))]) - seen
        if diverged(error[: len(white)], white):  # nothing is known
            no_move = np.zeros((1, len(phi))), np.diag(self.around.widest**2)[None]
            return ScaleMixture(np.ones(1), *no_move)
        return self.beside.gaussians(jac, error, self.noise, self.around.widest)

    def optimum(self, phi: Array) -> Optimum:
        """Return the optimum that steps from some coordinates lead to.

        On a long record the allowance for small effects may move it thousands of nats from the
        optimum without it, a distance over which no response is linear.

        Args:
            phi: coordinates to begin at, (p,).
        """
        lower, upper = self.around.box
        widest = self.around.widest
        centre, best, moves = phi, float(self._heights(phi[None])[0]), self._moves(phi)
        for step in range(_MOST_STEPS):
            least, most = np.maximum(-widest, lower - centre), np.minimum(widest, upper - centre)
            tries = centre + _LENGTHS[:, None] * _limited(moves, least, most)
            heights = self._heights(tries)
            longest = int(np.argmax(heights >= heights.max() - _NATS))
            # The first move goes to a mean, which may gain next to nothing.
            if not heights[longest] > best + (_NATS if step else -_NATS):
                break
            centre, best = tries[longest], float(heights[longest])
            moves = self._moves(centre)
        return Optimum(centre, moves, best)


def _limited(moves: ScaleMixture, least: Array, most: Array) -> Array:
    """Return the mean move (p,), given that coordinates end at the limits that it would pass."""
    mean, covariance = moves.moments()
    move, held = mean.copy(), np.zeros(len(mean), dtype=np.bool_)
    while (beyond := ~held & ((move < least) | (move > most))).any():
        held |= beyond
        move[held] = np.clip(move, least, most)[held]
        slopes = np.linalg.lstsq(covariance[np.ix_(held, held)], (move - mean)[held], rcond=None)
        move[~held] = mean[~held] + covariance[np.ix_(~held, held)] @ slopes[0]
    return move


def as_likely(scorer: Scorer, model: Model, theta: Array, other: Array) -> bool:
    """Whether the fitting part allows parameters `other` (p,) beside the best, `theta` (p,).

    It excludes them where they cost more than the 95 % region of a normal posterior, and more than
    twice the standard error over the blocks; a prior of the data counts.
    """
    data, rows = scorer.data, np.stack([theta, other])
    before, after = scorer.whiten(data.target - data.simulate(model, rows))
    lost = _per_block(after**2 - before**2, scorer.blocks)
    most = 0.5 * float(scipy.stats.chi2.ppf(0.95, len(theta)))
    cost = lost.sum()
    if data.prior is not None:
        best, there = data.prior.log_density(rows)
        cost += best - there
    return bool(cost <= max(most, _SURE * standard_error(lost)))


def _per_block(squares: Array, blocks: Sequence[slice]) -> Array:
    return np.array([0.5 * squares[block].sum() for block in blocks])
