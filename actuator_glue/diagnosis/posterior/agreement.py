"""Whether an effect has the same size in separate stretches of the records (Cochran 1954)."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import scipy

from actuator_glue.diagnosis.score.scorer import Scorer
from actuator_glue.diagnosis.thresholds import DISAGREE, SPREAD, STRETCH_KNOWN
from actuator_glue.diagnosis.trial import Trial
from actuator_glue.model.parameters import BASE
from actuator_glue.records import Array

_STRETCHES = 2  # of every record


@dataclass(frozen=True)
class Homogeneity:
    """An effect's size in each stretch that fixes it.

    Attributes:
        values: leading parameter per stretch, in the order of time and records [its unit].
        stddev: their standard errors, inflated for coloured residuals.
        p_value: of the hypothesis of equal sizes (NaN with fewer than two stretches).
        agree: False where p < 0.01 and the values spread by more than a quarter of the size;
            None where fewer than two stretches fix the size.
    """

    values: tuple[float, ...]
    stddev: tuple[float, ...]
    p_value: float
    agree: bool | None


class _Step(NamedTuple):
    """One Gauss-Newton step of scaled parameters; the first `own` are those of stretches.

    Attributes:
        rows: derivatives scaled to unit length, of parameters with any effect (p, N).
        scale: their lengths before (p,).
        inverse: inverse of their normal matrix (p, p).
        shift: the step (p,).
        own: number of the stretches' parameters.
    """

    rows: Array
    scale: Array
    inverse: Array
    shift: Array
    own: int

    @classmethod
    def of(cls, rows: Array, error: Array, count: int) -> _Step:
        """Solve for the step along rows (p, N) that best removes an error (N,)."""
        scale = np.sqrt(np.einsum('pn,pn->p', rows, rows))
        known = scale > 0.0
        rows, scale = rows[known] / scale[known, None], scale[known]
        inverse = np.asarray(np.linalg.pinv(rows @ rows.T, rcond=1e-10, hermitian=True))
        return cls(rows, scale, inverse, inverse @ (rows @ error), int(known[:count].sum()))

    @property
    def nominal(self) -> Array:
        """Variances of the stretches' scaled parameters under whitened noise (own,)."""
        return np.asarray(np.diag(self.inverse)[: self.own])


def agreement(trial: Trial, scorer: Scorer) -> dict[str, Homogeneity]:
    """Refit the leading parameter of every effect on the halves of each record.

    One Gauss-Newton step from the joint fit, on the whitened residual: the effect's leading
    parameter is free in every stretch, all other parameters are free but common, so a stretch
    that cannot identify Eq. (2) by itself borrows it from the rest. Standard errors are inflated
    by the block-clustered (sandwich) variance (Liang and Zeger 1986), never deflated.
    """
    error, jac = scorer.whiten(trial.fit.error), scorer.whiten(trial.fit.jacobian)
    edges = _halves(scorer)
    model = trial.structure
    out = {}
    for effect in model.entries:
        name = effect.name
        row = int(np.arange(len(trial.fit.theta))[model.columns(name)][0])
        value = float(trial.fit.theta[row])
        size = abs(value - (effect.parameters[0].neutral or 0.0))
        rows = _free_in_each(jac, row, edges)
        out[name] = _compare(rows, error, scorer.blocks, len(edges), value, size)
    return out


def between(trial: Trial, scorer: Scorer) -> Array:
    """Standard deviation of each parameter between stretches, beyond that due to noise (p,).

    In working coordinates; 0 where fewer than two stretches determine it. Wrong equations fit
    other parameters at each frequency and amplitude (a random effect: DerSimonian and Laird
    1986).
    """
    error, jac = scorer.whiten(trial.fit.error), scorer.whiten(trial.fit.jacobian)
    edges, out = _halves(scorer), np.zeros(len(trial.fit.theta))
    for row, reach in enumerate(_reaches(trial)):
        step = _Step.of(_free_in_each(jac, row, edges), error, len(edges))
        scale = step.scale[: step.own]
        shifts, variance = step.shift[: step.own] / scale, step.nominal / scale**2
        told = variance < (STRETCH_KNOWN * reach) ** 2
        if told.sum() > 1:
            beyond = shifts[told].var(ddof=1) - variance[told].mean()
            out[row] = np.sqrt(max(0.0, float(beyond)))
    return out


def _reaches(trial: Trial) -> Array:
    """Sizes of the parameters (p,): a factor of e for Eq. (2)'s, else the distance to neutral."""
    neutral = np.array([p.neutral or 0.0 for p in trial.model.parameters])
    reach = np.abs(trial.fit.theta - neutral)
    reach[: len(BASE)] = 1.0
    return np.asarray(reach)


def _halves(scorer: Scorer) -> list[tuple[int, int]]:
    out = []
    for part in scorer.data.parts:
        edges = np.linspace(part.start, part.stop, _STRETCHES + 1).astype(int)
        out += list(pairwise(edges.tolist()))
    return out


def _free_in_each(jac: Array, row: int, edges: list[tuple[int, int]]) -> Array:
    """Derivatives to one parameter in each of s stretches, then to the others (s + p - 1, N)."""
    split = np.zeros((len(edges), jac.shape[1]))
    for i, (a, b) in enumerate(edges):
        split[i, a:b] = jac[row, a:b]
    return np.concatenate([split, np.delete(jac, row, axis=0)])


def _compare(
    rows: Array,
    error: Array,
    blocks: tuple[slice, ...],
    count: int,
    value: float,
    size: float,
) -> Homogeneity:
    """Solve for the stretches' shifts (the first `count` rows) and test that they are equal."""
    step = _Step.of(rows, error, count)
    rows, scale, inverse, shift, count = step
    if not count:  # at the fit its size has no effect
        return Homogeneity((), (), float('nan'), None)
    left = error - shift @ rows
    pulls = np.stack([rows[:, b] @ left[b] for b in blocks])
    robust = inverse @ (pulls.T @ pulls) @ inverse * len(blocks) / max(1, len(blocks) - len(rows))
    nominal = step.nominal
    inflation = max(1.0, float(np.mean(np.diag(robust)[:count] / np.maximum(nominal, 1e-300))))
    covariance = inflation * inverse[:count, :count] / np.outer(scale[:count], scale[:count])
    shifts = (shift / scale)[:count]
    deviation = np.sqrt(np.diag(covariance))
    use = deviation < STRETCH_KNOWN * size
    values, deviation = value + shifts[use], deviation[use]
    sizes = tuple(float(v) for v in values), tuple(float(s) for s in deviation)
    freedom = int(use.sum()) - 1
    if freedom < 1:
        return Homogeneity(*sizes, float('nan'), None)
    contrast = np.eye(freedom + 1)[1:] - np.eye(freedom + 1)[0]
    difference = contrast @ values
    inner = contrast @ covariance[np.ix_(use, use)] @ contrast.T
    q = float(difference @ np.linalg.pinv(inner, hermitian=True) @ difference)
    p = float(scipy.stats.f.sf(q / freedom, freedom, max(1, len(blocks) - len(rows))))
    weights = 1.0 / deviation**2
    mean = float(np.average(values, weights=weights))
    spread = float(np.sqrt(np.average((values - mean) ** 2, weights=weights)))
    return Homogeneity(*sizes, p, not (p < DISAGREE and spread > SPREAD * size))
