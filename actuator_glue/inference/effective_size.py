"""Independent samples that an autocorrelated residual is worth to the parameters."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy

from actuator_glue.errors import InputError
from actuator_glue.records import Array

# Neighbouring frequencies over which the residual's density is averaged: at those where the
# parameters act the fit has taken up to two degrees of freedom a parameter, which must not pass
# for quiet.
_BAND = 31
# Singular value, of slopes of unit length, below which a direction cannot be told from others.
_TIED = 1e-2
# Degrees of freedom beyond the parameters, at which a posterior has a variance (docs/theory.md).
_FREEDOM = 4


def effective_size(errors: Sequence[Array], slopes: Sequence[Array]) -> float:
    """Return how many independent samples n_eff the residual's n samples are worth.

    Bartlett's (1935) size n/(sum_k rho_e(k) rho_s(k)), rho_e and rho_s the autocorrelations of
    residual and slopes; over several parameters the mean, which is the magnitude adjustment of
    Pauli et al. (2011). It is computed as the residual's spectral density at the frequencies where
    the parameters act, over its mean. Never more than n: what is loud elsewhere is no evidence.

    Args:
        errors: residual of each record, (n_r,).
        slopes: derivative of what is simulated to each parameter, in any coordinates, (p, n_r).

    Raises:
        InputError: no spread in the residual.
    """
    count = sum(len(e) for e in errors)
    mean = sum(float(e.sum()) for e in errors) / count
    power = sum(float(((e - mean) ** 2).sum()) for e in errors) / count
    if not (np.isfinite(power) and power > 0.0):
        raise InputError('the residual has no spread: its autocorrelation says nothing; give G')
    basis = _basis(np.concatenate([*slopes], axis=1))
    if not len(basis):
        return float(count)
    loud, begin = 0.0, 0
    for e in errors:
        part = basis[:, begin : begin + len(e)]
        begin += len(e)
        density = np.abs(np.fft.fft(e - mean)) ** 2 / len(e)
        density = scipy.ndimage.uniform_filter1d(density, min(_BAND, len(e)), mode='wrap')
        loud += float((np.abs(np.fft.fft(part)) ** 2 @ density).sum()) / len(e)
    worth = count / max(loud / (len(basis) * power), 1.0)
    return float(max(worth, min(count, len(slopes[0]) + _FREEDOM)))


def _basis(slopes: Array) -> Array:
    """Return orthonormal rows that span slopes (p, n) less their means, without what is tied."""
    rows = slopes - slopes.mean(axis=1, keepdims=True)
    size = np.sqrt((rows**2).sum(axis=1))
    rows = rows[size > 0.0] / size[size > 0.0, None]
    if not len(rows):
        return np.empty((0, slopes.shape[1]))
    values, turn = np.linalg.eigh(rows @ rows.T)
    keep = values > _TIED**2
    return np.asarray((turn[:, keep] / np.sqrt(values[keep])).T @ rows)
