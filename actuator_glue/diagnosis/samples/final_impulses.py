"""Impulses judged against the final model: what Eq. (2) lacks may look like impulses."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from actuator_glue.diagnosis.samples.preparation import Prepared
from actuator_glue.diagnosis.score.scorer import Scorer
from actuator_glue.diagnosis.thresholds import MOVING, SWAYING
from actuator_glue.diagnosis.trial import Trial
from actuator_glue.inference.least_squares.data import Mask
from actuator_glue.inference.least_squares.fit import Fit, fit
from actuator_glue.records import Array

_REFITS: Final = 3  # of the final model


def without_impulses(prepared: Prepared, final: Trial) -> Prepared:
    """Remove impulses judged against the final model; the same object if nothing changes.

    Judged against Eq. (2), an effect may look like an impulse, and once its samples are removed
    its fit is biased. So the structure is refitted without any suspected sample, and all are
    judged again.
    """
    clean = prepared.without_impulses(final.model, final.fit.theta)
    for _ in range(_REFITS):
        if clean is prepared:
            break
        rows = zip(clean.fit.masks, prepared.impulses, clean.impulses, strict=True)
        masks = tuple(_kept(mask, a.samples, b.samples) for mask, a, b in rows)
        theta = fit(replace(clean.fit, masks=masks), final.model, final.fit.theta).theta
        before, clean = clean, clean.without_impulses(final.model, theta)
        if clean is before:
            break
    return clean


def _kept(mask: Mask, *suspected: NDArray[np.intp]) -> Mask:
    out = mask.copy()
    out[np.concatenate(suspected)] = False
    return out


def swayed(found: Fit, scorer: Scorer, taken: Array) -> bool:
    """Return whether impulses removed or restored, (N,) [m], could have swayed the search.

    By their size, or by moving the fitted parameters a standard deviation in any direction.
    """
    if taken @ taken >= SWAYING * (found.error @ found.error):
        return True
    jac, white = scorer.whiten(found.jacobian), scorer.whiten(taken)
    jac /= np.maximum(np.linalg.norm(jac, axis=1, keepdims=True), 1e-300)
    along = jac @ white
    return bool(along @ np.linalg.pinv(jac @ jac.T, hermitian=True) @ along > MOVING**2)
