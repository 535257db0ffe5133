"""Evidence that the best of all candidates would reach on a healthy machine, by chance.

The null is a surrogate record: the base model's motion under stationary noise of the density that
was found. To first order a candidate's size then follows the projection of whitened noise on its
signature, so that the gain of the best of all is the maximum of half the squares of normal
numbers, correlated as the signatures are (max-statistic; Westfall & Young 1993).
"""

from __future__ import annotations

import math

import numpy as np
import scipy

from actuator_glue.diagnosis.score.scorer import Scorer
from actuator_glue.records import Array

_DRAWS = 4000
_SEED = 0
_KNOWN = 0.1  # level whose quantile the draws give; smaller levels follow from it


def threshold(signatures: Array, jacobian: Array, scorer: Scorer, level: float) -> float:
    """Return the evidence that the best candidate exceeds by chance at a given level [nats].

    Args:
        signatures: responses to the candidates at their starting sizes (s, N) [m].
        jacobian: of Eq. (2) at its fit (p, N), which takes up its part of the noise.
        scorer: noise.
        level: probability of a false alarm.
    """
    q = np.linalg.qr(scorer.whiten(jacobian).T)[0]
    rows = np.empty(signatures.shape, dtype=np.float32)
    kept = 0
    for signature in signatures:  # one by one: whitened rows of a long record are large
        row = scorer.whiten(signature)
        size = float(np.linalg.norm(row))
        row = row - q @ (row @ q)
        free = float(np.linalg.norm(row))
        if free > 1e-6 * size:
            rows[kept] = row / free
            kept += 1
    if not kept:
        return 0.0
    correlation = np.asarray(rows[:kept] @ rows[:kept].T, dtype=np.float64)
    values, vectors = np.linalg.eigh(correlation)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    normal = np.random.default_rng(_SEED).standard_normal((_DRAWS, kept))
    most = np.abs(normal @ root.T).max(axis=1)
    # Number of independent candidates that would exceed that quantile as often.
    known = float(np.quantile(most, 1.0 - _KNOWN))
    independent = math.log1p(-_KNOWN) / math.log1p(-2.0 * float(scipy.stats.norm.sf(known)))
    single = -math.expm1(math.log1p(-level) / max(1.0, independent))
    return 0.5 * float(scipy.stats.norm.isf(0.5 * single)) ** 2
