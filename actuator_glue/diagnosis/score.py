"""Out-of-sample evidence of refitted structures, in nats of independent samples.

The residual is whitened by its own noise density, so that a coloured background does not count
twice. Each block is scored with parameters fitted without it: for least squares that refit is
the influence formula d = (J J' - J_b J_b')^-1 J_b e_b, exact where the model is linear in its
parameters (Cook 1977).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from actuator_glue.diagnosis.data import Data
from actuator_glue.diagnosis.fit import Fit
from actuator_glue.diagnosis.noise import Split, split, whiten, whitener
from actuator_glue.diagnosis.stretches import Part
from actuator_glue.records import Array

BLOCK = 2.0  # s


@dataclass(frozen=True)
class Scorer:
    """Whitening filters and blocks of one data set.

    Attributes:
        data: the counted samples.
        taps: whitening filter of each record.
        blocks: slices of the joined vectors.
    """

    data: Data
    taps: tuple[Array, ...]
    blocks: tuple[slice, ...]

    @classmethod
    def of(cls, data: Data, splits: list[Split], *, misfit: bool = False) -> Scorer:
        """Take the noise of each record from the split of its residual, or all that is in it."""
        if misfit:
            splits = [replace(s, psd=s.psd + np.maximum(s.excess, 0.0)) for s in splits]
        blocks = []
        for period, part in zip(data.periods, data.parts, strict=True):
            size = part.stop - part.start
            count = max(2, round(size * period / BLOCK))
            edges = part.start + np.linspace(0, size, count + 1).astype(int)
            blocks += [slice(int(a), int(b)) for a, b in pairwise(edges)]
        return cls(data, tuple(whitener([s]) for s in splits), tuple(blocks))

    def of_part(self, part: Part) -> Scorer:
        """Return the same noise for a part of the data, which has no blocks."""
        return Scorer(part.data, tuple(self.taps[i] for i in part.records), ())

    def whiten(self, rows: Array) -> Array:
        """Whiten joined rows (..., N), each run without a gap by itself."""
        out = np.empty_like(rows)
        table, found = (a.reshape(-1, rows.shape[-1]) for a in (rows, out))
        for taps, runs in zip(self.taps, self.data.runs, strict=True):
            for _, run in runs:
                found[:, run] = whiten(table[:, run], taps)
        return out

    def block_scores(self, fit: Fit) -> Array:
        """Log density of each block under parameters fitted without it (B,), up to a constant."""
        error, jac = self.whiten(fit.error), self.whiten(fit.jacobian)
        scale = np.sqrt(np.einsum('pn,pn->p', jac, jac))
        jac = jac[scale > 0] / scale[scale > 0, None]
        out = np.empty(len(self.blocks))
        for i, (block, shift) in enumerate(
            zip(self.blocks, self._shifts(error, jac), strict=True)
        ):
            e = error[block]
            predicted = e + jac[:, block].T @ shift
            # A block that alone fixes a parameter must not explode: it is scored as fitted.
            worst = 4.0 * float(e @ e) + 8.0
            out[i] = -0.5 * min(float(predicted @ predicted), worst)
        return out

    def left_out_error(self, fit: Fit) -> float:
        """Rms error of all blocks, each under parameters fitted without it [m]."""
        error, jac = self.whiten(fit.error), self.whiten(fit.jacobian)
        scale = np.sqrt(np.einsum('pn,pn->p', jac, jac))
        known = scale > 0
        jac, raw = jac[known] / scale[known, None], fit.jacobian[known] / scale[known, None]
        total = 0.0
        for block, shift in zip(self.blocks, self._shifts(error, jac), strict=True):
            e = fit.error[block]
            predicted = e + raw[:, block].T @ shift
            total += min(float(predicted @ predicted), 4.0 * float(e @ e))
        return float(np.sqrt(total / len(error)))

    def _shifts(self, error: Array, jac: Array) -> list[Array]:
        """What each block moves the parameters by (whitened rows of unit length)."""
        normal = jac @ jac.T
        # Prior of the shift, 30 of these nats wide: keeps directions no block fixes at rest.
        ridge = 1e-3 * np.eye(len(jac))
        out: list[Array] = []
        for block in self.blocks:
            j = jac[:, block]
            out.append(np.asarray(np.linalg.solve(normal - j @ j.T + ridge, j @ error[block])))
        return out


def evidence(scores: Array, reference: Array) -> float:
    """Return the gain of block scores over a reference without its best block [nats].

    What one stretch of a record alone supports is not evidence about the actuator.
    """
    difference = scores - reference
    return float(difference.sum() - max(0.0, difference.max()))


def splits_of(data: Data, error: Array) -> list[Split]:
    """Split the joined residual of every record."""
    parts = data.split(error)
    return [split(e, period) for e, period in zip(parts, data.periods, strict=True)]


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
