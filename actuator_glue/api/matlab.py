"""A posterior as a .mat file: draws, and Eq. (2a) as MATLAB's `tf` takes it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import scipy

from actuator_glue.given import path as given_path
from actuator_glue.model.parameters import NAMES
from actuator_glue.records import Array
from actuator_glue.whole_file import whole_file


class TransferFunction(NamedTuple):
    """A model as MATLAB takes it, descending powers of s.

    Attributes:
        stiffness: of the specimen [N/m]; NaN where it is not known.
        num, den: polynomials of the mean of the draws.
        delay: of the command, less its lead [s].
        num_draws, den_draws: polynomials of each draw, a row each.
    """

    stiffness: float
    num: Array
    den: Array
    delay: float
    num_draws: Array
    den_draws: Array


def under(draws: Array, names: Sequence[str], stiffness: float) -> TransferFunction:
    """Return Eq. (2a) of draws (m, p) of named parameters under a stiffness [N/m]."""
    columns = [names.index(name) for name in NAMES]
    mean = draws.mean(axis=0)
    late = delay_of(names, mean)
    drawn = [polynomials(theta, stiffness) for theta in draws[:, columns]]
    rows = np.array([n for n, _ in drawn]), np.array([d for _, d in drawn])
    return TransferFunction(stiffness, *polynomials(mean[columns], stiffness), late, *rows)


def delay_of(names: Sequence[str], theta: Array) -> float:
    """Return the delay of the command, less its lead, of parameters theta (p,) [s]."""
    known = dict(zip(names, theta, strict=False))
    return float(known.get('delay', 0.0) - known.get('lead', 0.0))


def polynomials(theta: Array, stiffness: float) -> tuple[Array, Array]:
    """Return numerator and denominator of Eq. (2a), descending powers of s.

    x/u = alpha_1_beta_0 / ((k + alpha_2) s^2 + (alpha_3 k + beta_1 k + beta_1 alpha_2) s
    + beta_1 alpha_3 k + alpha_1_beta_0).

    Args:
        theta: beta_1, alpha_1_beta_0, alpha_2, alpha_3, shape (4,), SI units.
        stiffness: of the specimen k [N/m].
    """
    beta_1, gain, alpha_2, alpha_3 = (float(v) for v in theta)
    k = float(stiffness)
    middle = alpha_3 * k + beta_1 * k + beta_1 * alpha_2
    return np.array([gain]), np.array([k + alpha_2, middle, beta_1 * alpha_3 * k + gain])


def write_mat(
    path: Path | str,
    draws: Array,
    units: Mapping[str, str],
    models: Sequence[TransferFunction],
    *,
    effects: Sequence[str],
    problems: Sequence[str],
) -> Path:
    """Write draws and models under some stiffnesses to a .mat file; return its path.

    Its folder is made if need be.

    Variables: `draws` (m x p), `names`, `units`, `effects`, `problems` (cells), `mean`, `stddev`
    (1 x p), `covariance` (p x p), `model`: a struct for each stiffness with `stiffness`, `num`,
    `den` of the mean of the draws, `delay` [s], and `num_draws`, `den_draws`, a row for each draw.
    `tf(model(1).num, model(1).den, 'InputDelay', model(1).delay)` is the actuator in MATLAB.

    Args:
        path: where to.
        draws: of the posterior, shape (m, p), SI units.
        units: unit of each parameter by name, in the order of the columns.
        models: one for each stiffness.
        effects: of the model beyond Eq. (2).
        problems: why the posterior must not be used as it stands.

    Raises:
        InputError: no path, or the file cannot be written.
    """
    kinds = [(name, object) for name in TransferFunction._fields]
    model = np.zeros((1, len(models)), dtype=kinds)
    for i, each in enumerate(models):
        model[0, i] = tuple(each)
    content = {
        'draws': draws,
        'names': _cells([*units.keys()]),
        'units': _cells([*units.values()]),
        'effects': _cells(effects),
        'problems': _cells(problems),
        'mean': draws.mean(axis=0),
        'stddev': draws.std(axis=0),
        'covariance': np.atleast_2d(np.cov(draws, rowvar=False)),
        'model': model,
    }
    path = given_path(path)
    with whole_file(path) as part:
        scipy.io.savemat(str(part), content, appendmat=False, do_compression=True)
    return path


def _cells(texts: Sequence[str]) -> np.ndarray:
    """Return texts as MATLAB's cell array, empty ones too."""
    out = np.empty(len(texts), dtype=object)
    out[:] = list(texts)
    return out
