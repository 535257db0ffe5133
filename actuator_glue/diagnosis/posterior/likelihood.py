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
from actuator_glue.inference.least_squares.data import Data, lanes
from actuator_glue.inference.least_squares.each import Each
from actuator_glue.inference.least_squares.fit import Fit
from actuator_glue.inference.least_squares.fit import fit as fit_to
from actuator_glue.inference.least_squares.free_run import Model
from actuator_glue.inference.least_squares.space import Space, diverged
from actuator_glue.records import Array

_STEPS = 8  # from the least-squares fit to the optimum of the likelihood
_HALVINGS = 40  # bring any point inside the bounds of the prior
# From the optimum of the whitened error to that of the likelihood: a step that gains less ends
# the search.
_NATS, _MOST_STEPS = 0.5, 10
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

    def _height(self, phi: Array) -> float:
        """Log density at coordinates (p,), the prior of the coordinates included."""
        theta, log_prior = self.around.inverse(phi[None])
        return float(self(theta)[0] + log_prior[0])

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
        best, moves = self._height(phi), self._moves(phi)
        centre, new = phi, _inside(self.around, phi, moves.moments()[0])
        for step in range(1, _MOST_STEPS):
            height = self._height(new)
            # The first move goes to a mean, which may gain next to nothing.
            if not height > best + (_NATS if step > 1 else -_NATS):
                break
            centre, best, moves = new, height, self._moves(new)
            new = _inside(self.around, centre, moves.moments()[0])
        return Optimum(centre, moves, best)


def _inside(around: Working | Straight, phi: Array, move: Array) -> Array:
    """Return coordinates (p,) moved as far as they stay inside the bounds."""
    move = np.clip(move, -around.widest, around.widest)
    for _ in range(_HALVINGS):
        if np.isfinite(around.inverse((phi + move)[None])[1][0]):
            return phi + move
        move *= 0.5
    return phi


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
