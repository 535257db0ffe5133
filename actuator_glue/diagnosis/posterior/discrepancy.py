"""Effects too small to matter, as a random discrepancy with the catalogue's responses.

An effect that is too small to be added still biases the parameters: 20 N of friction do not matter
in the error, but shift alpha_3 by many standard deviations. So the likelihood contains, besides
noise, the response to every effect that was not added, each of random size. Their common scale,
from zero to material, is unknown and integrated out (Kennedy & O'Hagan 2001, with physics for
shapes). Effects so small act linearly and are marginalised in closed form.
"""

from __future__ import annotations

from collections.abc import Container, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from actuator_glue.diagnosis.refits.refits import Refits
from actuator_glue.diagnosis.samples import record_zero
from actuator_glue.diagnosis.score.scorer import Scorer
from actuator_glue.inference.least_squares.fit import rms
from actuator_glue.inference.least_squares.space import sum_of_squares
from actuator_glue.model.parameters import BASE
from actuator_glue.records import Array

_P = len(BASE)

# Scales, relative to the largest: zero is as likely as all others together.
_SCALES = np.concatenate([[0.0], 2.0 ** np.arange(-6.0, 1.0)])
_PRIOR = np.log(np.concatenate([[0.5], np.full(len(_SCALES) - 1, 0.5 / (len(_SCALES) - 1))]))
_FLAT = 1e-8  # prior precision of a flat parameter, over what the records alone tell of it
# Least response to a parameter's whole prior width that counts as a slope, in standard deviations
# of noise: derivatives are rounded, to some 1e-9.
_NONE = 1e-6
_SAME = 1e-10  # of the largest power: a weaker shape is a combination of others


class ScaleMixture(NamedTuple):
    """Normal distributions of a shift of parameters, one for each scale of the discrepancy.

    Attributes:
        weights: of the scales (s,), sum 1.
        means: (s, p).
        covariances: (s, p, p).
    """

    weights: Array
    means: Array
    covariances: Array

    def moments(self) -> tuple[Array, Array]:
        """Mean (p,) and covariance (p, p) of the whole mixture."""
        mean = self.weights @ self.means
        off = self.means - mean
        covariance = np.einsum('s,sij->ij', self.weights, self.covariances)
        covariance += np.einsum('s,si,sj->ij', self.weights, off, off)
        return mean, covariance


@dataclass(frozen=True)
class Discrepancy:
    """Normal discrepancies of a whitened error, of unknown scale.

    Attributes:
        shapes: orthogonal whitened shapes of unit length (s, N).
        powers: their variances at the largest scale (s,).
    """

    shapes: Array
    powers: Array

    @classmethod
    def of(cls, rows: Array) -> Discrepancy:
        """Build from whitened responses at the largest scale (e, N), each of its own size."""
        values, vectors = np.linalg.eigh(rows @ rows.T)
        kept = values > _SAME * values.max(initial=0.0)
        powers = values[kept]
        shapes = vectors[:, kept].T @ rows
        shapes /= np.sqrt(powers)[:, None]
        return cls(shapes, powers)

    def without(self, error: Array) -> Array:
        """Return a whitened error (N,) less its projection on the shapes."""
        return np.asarray(error - (self.shapes @ error) @ self.shapes)

    def log_likelihood(self, errors: Array, noise: float) -> Array:
        """Log density of whitened errors (m, N), up to a constant, (m,).

        Minus infinity where a simulation diverged.

        Args:
            errors: whitened free-run errors, (m, N).
            noise: variance of the whitened noise.
        """
        squares = sum_of_squares(errors)
        stable = np.isfinite(squares)
        out = np.full(len(errors), -np.inf)
        if not stable.all():
            errors, squares = errors[stable], squares[stable]
        along = (errors @ self.shapes.T) ** 2
        rows = []
        for scale, prior in zip(_SCALES, _PRIOR, strict=True):
            power = scale**2 * self.powers
            left = squares - along @ (power / (noise + power))
            rows.append(prior - 0.5 * left / noise - 0.5 * np.log1p(power / noise).sum())
        out[stable] = np.logaddexp.reduce(rows, axis=0)
        return out

    def gaussians(
        self, jacobian: Array, error: Array, noise: float, widest: Array
    ) -> ScaleMixture:
        """Return the distribution of parameter shifts under a linear response.

        Args:
            jacobian: whitened derivatives of the simulation (p, N).
            error: whitened error (N,); entries beyond the shapes', in both, are a prior's.
            noise: variance of the whitened noise.
            widest: standard deviations (p,) of what is known without any record.
        """
        size = np.sqrt(np.einsum('pn,pn->p', jacobian, jacobian))
        # The logarithm of a near-zero leakage has hardly a slope, and its prior width does not
        # limit it: its ridge with a gain is left as it is.
        flat = (size > _NONE / widest) & ((widest * size) ** 2 < noise)
        # Effects' are never flat: two known only by their product would be held on a line.
        flat[_P:] = False
        size = np.maximum(size, _NONE / widest)
        floor = np.where(flat, _FLAT, 1.0 / (widest * size) ** 2)
        jac = jacobian / size[:, None]
        count, length = self.shapes.shape
        seen, along = self.shapes @ jac[:, :length].T, self.shapes @ error[:length]
        weights, means, covariances = [], [], []
        # Without any shape all scales are the same.
        for scale, prior in list(zip(_SCALES, _PRIOR, strict=True))[: None if count else 1]:
            power = scale**2 * self.powers
            share = power / (noise + power)
            normal = (jac @ jac.T - seen.T @ (share[:, None] * seen)) / noise
            normal[np.diag_indices(len(size))] += floor
            covariance = np.linalg.inv(normal)
            pull = (jac @ error - seen.T @ (share * along)) / noise
            mean = covariance @ pull
            left = (error @ error - share @ along**2) / noise - pull @ mean
            spread = np.log1p(power / noise).sum() + np.linalg.slogdet(normal)[1]
            weights.append(prior - 0.5 * (left + spread))
            means.append(mean)
            covariances.append(covariance)
        share = np.exp(np.array(weights) - np.logaddexp.reduce(weights))
        return ScaleMixture(share, np.array(means) / size, covariances / np.outer(size, size))


def responses(refits: Refits, size: float) -> dict[str, Array]:
    """Return what each effect, scaled to a given rms, adds to the response of fitted Eq. (2).

    Args:
        refits: what was tried, and the fit of Eq. (2).
        size: rms of each response [m].

    Returns:
        Per name the response (N,) [m]; effects without one are left out. Also each record's
        offset and drift.
    """
    data, base = refits.data, refits.scale().theta
    off = data.simulate(refits.structure(), base)[0]

    def one(name: str) -> Array:
        alone = refits.structure(name)
        starts, seen = refits.promises.signature(name)
        neutral = alone.parameters[len(base)].neutral or 0.0
        nearest = int(np.argmin(np.abs(starts[:, 0] - neutral)))
        theta = np.concatenate([base, starts[nearest]])
        # Its shape near that size: large play and friction have another shape.
        share = min(1.0, size / max(rms(seen[nearest]), 1e-12))
        theta[len(base)] = neutral + (theta[len(base)] - neutral) * share
        return np.asarray(data.simulate(alone, theta)[0] - off)

    found = dict(zip(refits.names, refits.each(one, refits.names), strict=True))
    sizes = {name: rms(response) for name, response in found.items()}
    out = {n: r * (size / sizes[n]) for n, r in found.items() if 0.0 < sizes[n] < 1.0}
    # Each record has a zero of its own, with a drift.
    for i, (part, line) in enumerate(record_zero.lines(data)):
        for which, row in zip(('offset', 'drift'), line, strict=True):
            own = np.zeros(data.target.size)
            own[part] = size * row
            out[f'{which} of record {i + 1}'] = own
    return out


def beside(small: Mapping[str, Array], effects: Container[str], scorer: Scorer) -> Discrepancy:
    """Return the discrepancy of small effects that a structure does not hold."""
    rows = [scorer.whiten(row) for name, row in small.items() if name not in effects]
    size = sum(part.stop - part.start for part in scorer.data.parts)
    return Discrepancy.of(np.reshape(rows, (-1, size)))
