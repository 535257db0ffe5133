"""Out-of-sample evidence of refitted structures, in nats of independent samples.

The residual is whitened by its own noise density, so that a coloured background does not count
twice. Each block is scored with parameters fitted without it: d = (J J' - J_b J_b')^-1
(J e - J_b e_b) away from the fit, exact where the model is linear in its parameters (Cook 1977,
for a fit that is itself the optimum: J e = 0). Where only noise is left, e and J are whitened:
these are the optimum and the covariance of the sampled one (posterior/likelihood.py).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from weakref import WeakKeyDictionary

import numpy as np

from actuator_glue.diagnosis.trial import Trial
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.inference.least_squares.fit import Fit
from actuator_glue.inference.least_squares.stretches import Part
from actuator_glue.inference.noise import Split, split, whiten, whitener
from actuator_glue.records import Array

BLOCK = 2.0  # s


@dataclass(frozen=True)
class Scorer:
    """Whitening filters and blocks of one data set.

    Attributes:
        data: the counted samples.
        taps: whitening filter of each record.
        blocks: slices of the joined vectors.
        likely: whether blocks are scored under the parameters that are most likely without them,
            as where only noise is left; with misfit, least-squares parameters leave less error.
    """

    data: Data
    taps: tuple[Array, ...]
    blocks: tuple[slice, ...]
    likely: bool = True
    _known: WeakKeyDictionary[Fit, Array] = field(
        default_factory=WeakKeyDictionary, init=False, compare=False, repr=False
    )
    _errors: WeakKeyDictionary[Fit, float] = field(
        default_factory=WeakKeyDictionary, init=False, compare=False, repr=False
    )

    @classmethod
    def of(cls, data: Data, splits: list[Split], *, misfit: bool = False) -> Scorer:
        """Take each record's noise from the split of its residual; with `misfit`, all of it."""
        if misfit:
            splits = [s.all_of_it() for s in splits]
        blocks = []
        for period, part in zip(data.periods, data.parts, strict=True):
            size = part.stop - part.start
            count = max(2, round(size * period / BLOCK))
            edges = part.start + np.linspace(0, size, count + 1).astype(int)
            blocks += [slice(int(a), int(b)) for a, b in pairwise(edges)]
        return cls(data, tuple(whitener(s) for s in splits), tuple(blocks), not misfit)

    def of_part(self, part: Part) -> Scorer:
        """Return the same noise for a part of the data, which has no blocks."""
        return Scorer(part.data, tuple(self.taps[i] for i in part.records), ())

    def whiten(self, rows: Array, record: int | None = None) -> Array:
        """Whiten joined rows (..., N), or those of one record (..., n), run by run.

        Each run without a gap is whitened by itself.
        """
        which = range(len(self.taps)) if record is None else (record,)
        start = 0 if record is None else self.data.parts[record].start
        out = np.empty_like(rows)
        table, found = (a.reshape(-1, rows.shape[-1]) for a in (rows, out))
        for i in which:
            for _, run in self.data.runs[i]:
                own = slice(run.start - start, run.stop - start)
                found[:, own] = whiten(table[:, own], self.taps[i])
        return out

    def block_scores(self, fit: Fit) -> Array:
        """Log density of each block under parameters fitted without it (B,), up to a constant."""
        if fit not in self._known:
            self._known[fit] = self._block_scores(fit)
        return self._known[fit]

    def scored(self, trial: Trial) -> Trial:
        """Return a structure with the block scores under this noise."""
        return replace(trial, scores=self.block_scores(trial.fit))

    def _block_scores(self, fit: Fit) -> Array:
        error, jac = self.whiten(fit.error), self.whiten(fit.jacobian)
        fitted = (error, jac) if self.likely else _plain(fit)
        out = np.empty(len(self.blocks))
        for i, move in enumerate(self.moves(fit, *fitted, self.blocks)):
            e = error[self.blocks[i]]
            left = e - move @ jac[:, self.blocks[i]]
            # The score of a block that alone fixes a parameter must not explode: it is limited.
            out[i] = -0.5 * min(float(left @ left), 4.0 * float(e @ e) + 8.0)
        return out

    def left_out_error(self, fit: Fit) -> float:
        """Rms error of all blocks, each under least-squares parameters fitted without it [m].

        Errors compared in metres are fitted in metres, as the structures themselves are. At least
        the error of the fit: short of its optimum a step promises less than any fit has reached.
        """
        if fit not in self._errors:
            self._errors[fit] = self._left_out_error(fit)
        return self._errors[fit]

    def _left_out_error(self, fit: Fit) -> float:
        total, moves = 0.0, self.moves(fit, *_plain(fit), self.blocks)
        for block, move in zip(self.blocks, moves, strict=True):
            e = fit.error[block]
            left = e - move @ fit.jacobian_of(block)
            total += min(float(left @ left), 4.0 * float(e @ e))
        return max(float(np.sqrt(total / len(fit.error))), fit.rms)

    def moves(self, fit: Fit, error: Array, jac: Array, blocks: Sequence[slice]) -> Array:
        """Return how far the optimum without each block is from a fit, (B, p), within the bounds.

        Args:
            fit: a structure.
            error: its error, of unit variance, whose squares are least at the optimum (N,).
            jac: derivatives of what is simulated, in the same units (p, N).
            blocks: what is left out, one at a time.
        """
        scale = np.sqrt(np.einsum('pn,pn->p', jac, jac))
        room = np.multiply([[-np.inf], [np.inf]], np.ones(len(jac)))
        room[:, : fit.room.shape[1]] = fit.room
        known = scale > 0
        scale = scale[known]
        jac, room = jac[known] / scale[:, None], room[:, known] * scale
        # Prior of the move, 30 standard deviations wide: directions that no block fixes stay.
        normal, pull = jac @ jac.T + 1e-3 * np.eye(len(jac)), jac @ error
        if self.data.prior is not None:
            size = np.sqrt(np.mean(error**2))
            slopes = size * self.data.prior.slopes(len(known))[known] / scale[:, None]
            normal += slopes @ slopes.T
            pull -= slopes @ (size * self.data.prior.pull(fit.z))
        normals, pulls = np.tile(normal, (len(blocks), 1, 1)), np.tile(pull, (len(blocks), 1))
        for i, block in enumerate(blocks):
            j = jac[:, block]
            normals[i] -= j @ j.T
            pulls[i] -= j @ error[block]
        out = np.zeros((len(blocks), len(known)))
        out[:, known] = _steps(normals, pulls, room) / scale
        return out


def _plain(fit: Fit) -> tuple[Array, Array]:
    """Error (N,) and Jacobian (p, N) of least squares, in units of the error's rms."""
    size = max(fit.rms, 1e-300)
    return fit.error / size, fit.jacobian / size


def _steps(normals: Array, pulls: Array, room: Array) -> Array:
    """Return Gauss-Newton steps (B, p); parameters stop at the end of their room (2, p)."""
    steps = np.asarray(np.linalg.solve(normals, pulls[..., None])[..., 0])
    free, left = np.ones(pulls.shape, dtype=np.bool_), np.arange(len(pulls))
    while left.size:
        out = free[left] & ((steps[left] < room[0]) | (steps[left] > room[1]))
        left, out = left[out.any(axis=1)], out[out.any(axis=1)]
        steps[left], free[left] = np.clip(steps[left], *room), free[left] & ~out
        left = left[free[left].any(axis=1)]
        # What is stopped takes the place of its equation: it is where it is.
        stopped, normal = ~free[left], normals[left]
        pull = pulls[left] - np.einsum('bij,bj->bi', normal, np.where(stopped, steps[left], 0.0))
        both = stopped[:, :, None] | stopped[:, None, :]
        normal = np.where(both, np.eye(pulls.shape[1]) * stopped[:, :, None], normal)
        pull = np.where(stopped, steps[left], pull)
        steps[left] = np.linalg.solve(normal, pull[..., None])[..., 0]
    return steps


def evidence(scores: Array, reference: Array) -> float:
    """Return the gain of block scores over a reference, the best block left out [nats].

    A gain that one stretch of a record alone supports is not evidence about the actuator.
    """
    difference = scores - reference
    return float(difference.sum() - max(0.0, difference.max()))


def standard_error(difference: Array) -> float:
    """Return the standard error of the sum of block differences (B,) [nats].

    It says how far they are chance.
    """
    # Squares may overflow for a structure that diverges without a block.
    size = float(np.abs(difference).max()) or 1.0
    return float(np.sqrt(len(difference)) * (difference / size).std(ddof=1)) * size


def splits_of(data: Data, error: Array) -> list[Split]:
    """Split the joined residual of every record."""
    parts = data.split(error)
    return [split(e, period) for e, period in zip(parts, data.periods, strict=True)]


def structure_and_noise(data: Data, error: Array) -> tuple[float, float]:
    """Return what a joined residual (N,) holds: structure and noise of all records, rms [m]."""
    return pooled(data, splits_of(data, error))


def pooled(data: Data, splits: list[Split]) -> tuple[float, float]:
    """Return structure and noise of all records together, rms over the counted samples [m]."""
    sizes = np.array([p.stop - p.start for p in data.parts], dtype=np.float64)
    structure = np.array([s.mean_square - s.noise**2 for s in splits])
    noise = np.array([s.noise**2 for s in splits])
    total = sizes.sum()
    return (
        float(np.sqrt(max(0.0, (sizes * structure).sum() / total))),
        float(np.sqrt((sizes * noise).sum() / total)),
    )


def inflation(error: Array) -> float:
    """Variance of whitened noise that a whitened error (N,) implies, at least 1.

    Where structure remains, every parameter is known less well than the noise alone says.
    """
    return max(1.0, float(np.mean(error**2)))
