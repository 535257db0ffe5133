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
# Command and displacement: what is equal within this share of its range is the same value; and the
# shortest period [samples].
_SAME, _SHORTEST = 1e-6, 4


def effective_size(
    errors: Sequence[Array],
    slopes: Sequence[Array],
    motions: Sequence[tuple[Array, Array]] = (),
) -> float:
    """Return how many independent samples n_eff the residual's n samples are worth.

    Bartlett's (1935) size n/(sum_k rho_e(k) rho_s(k)), rho_e and rho_s the autocorrelations of
    residual and slopes; over several parameters the mean, which is the magnitude adjustment of
    Pauli et al. (2011). It is computed as the residual's spectral density at the frequencies where
    the parameters act, over its mean. Never more than n: what is loud elsewhere is no evidence.

    Rounding to a grid that is coarser than the noise repeats with a repeated command: lines
    between which the density is low. k periods say no more of it than one: it counts k times.

    Args:
        errors: residual of each record, (n_r,).
        slopes: derivative of what is simulated to each parameter, in any coordinates, (p, n_r).
        motions: commanded and measured displacement of each record, (n_r,) each [m]; empty where
            no grid is known.

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
    loud, again, begin = 0.0, 0.0, 0
    for i, e in enumerate(errors):
        part = basis[:, begin : begin + len(e)]
        begin += len(e)
        density = np.abs(np.fft.fft(e - mean)) ** 2 / len(e)
        density = scipy.ndimage.uniform_filter1d(density, min(_BAND, len(e)), mode='wrap')
        acts = np.empty_like(part)  # of long records the spectra of all would fill the memory
        for row, out in zip(part, acts, strict=True):
            np.square(np.abs(np.fft.fft(row)), out=out)
        loud += float((acts @ density).sum()) / len(e)
        del acts
        if motions:
            stretch, rounding = _rounding(e - mean, *motions[i])
            again += rounding * float((part[:, stretch] ** 2).sum())
    each = len(basis) * power
    worth = count / (max(loud / each, 1.0) + again / each)
    return float(max(worth, min(count, len(slopes[0]) + _FREEDOM)))


def _basis(slopes: Array) -> Array:
    """Return orthonormal rows that span slopes (p, n) less their means, without what is tied."""
    rows = slopes - slopes.mean(axis=1, keepdims=True)
    size = np.sqrt((rows**2).sum(axis=1))
    rows, size = (rows, size) if (size > 0.0).all() else (rows[size > 0.0], size[size > 0.0])
    rows /= size[:, None]
    if not len(rows):
        return np.empty((0, slopes.shape[1]))
    values, turn = np.linalg.eigh(rows @ rows.T)
    keep = values > _TIED**2
    return np.asarray((turn[:, keep] / np.sqrt(values[keep])).T @ rows)


def _rounding(error: Array, command: Array, measured: Array) -> tuple[slice, float]:
    """Return where a record ends in k periods of its command, and (k - 1) times their rounding.

    The rounding's mean square is that of the mean period, less its share of what differs from
    period to period, and at most that of a grid; the rest of it is no rounding [m^2].
    """
    nothing = slice(0, 0), 0.0
    values, size = np.unique(measured), _period(command)
    grid = float(np.diff(values).min(initial=np.inf))
    if size < _SHORTEST or len(values) == 1 or grid <= _SAME * np.ptp(values):
        return nothing
    differs = np.flatnonzero(np.abs(command[size:] - command[:-size]) > _SAME * np.ptp(command))
    begin = int(differs[-1]) + 1 if len(differs) else 0
    count = (len(command) - begin) // size
    stretch = slice(len(command) - count * size, len(command))
    periods = error[stretch].reshape(count, size)
    middle = periods.mean(axis=0)
    other = float(((periods - middle) ** 2).sum()) / ((count - 1) * size)
    rounding = min(max(float((middle**2).mean()) - other / count, 0.0), grid**2 / 12.0)
    return stretch, (count - 1) * rounding


def _period(command: Array) -> int:
    """Return the samples after which a command's end repeats what was before; 0 if it does not."""
    back, same = command[::-1], _SAME * float(np.ptp(command))
    rest = int((np.abs(back - back[0]) > same).argmax())  # readings of a slow motion are alike
    sizes = np.arange(rest + 1, len(back) // 2 + 1)
    for i in range(_SHORTEST):  # most are none by these alone
        sizes = sizes[np.abs(back[sizes + i] - back[i]) <= same] if len(sizes) else sizes
    for size in sizes:
        if np.abs(back[:size] - back[size : 2 * size]).max() <= same:
            return int(size)
    return 0
