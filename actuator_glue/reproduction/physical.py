"""The joint fit of Eq. (2) to both tests, beside Table 2 and what its values imply."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from actuator_glue.model import linear
from actuator_glue.model.exact import ExactErrors
from actuator_glue.model.parameters import TABLE_2, bounds
from actuator_glue.model.problem_r import EQUATION_3, STIFFNESS
from actuator_glue.records import Array, Record


@dataclass(frozen=True, slots=True, eq=False)
class PhysicalFit:
    """Parameters of Eq. (2) that fit both tests best by Eq. (4), and standard errors.

    Attributes:
        theta: beta_1, alpha_1_beta_0, alpha_2, alpha_3, shape (4,).
        stddev: standard errors for white residuals, shape (4,); NaN for one on its bound.
        at_bound: which parameters sit on a bound of Table 3, shape (4,) bool.
        rms: rms simulation error of each test [m].
        table_2_rms: the same with Table 2's parameters [m].
    """

    theta: Array
    stddev: Array
    at_bound: NDArray[np.bool_]
    rms: Array
    table_2_rms: Array


@dataclass(frozen=True, slots=True)
class Coefficient:
    """One coefficient of Eq. (2b) that the experiment identified, and what thetas give for it.

    Attributes:
        name: d_1/d_2, d_0/d_2 or n_0/d_2.
        stiffness: specimen stiffness of the test [N/m].
        identified: value in Eq. (3a) or (3b).
        table_2: value from Table 2's parameters.
        fitted: value from the joint fit.
    """

    name: str
    stiffness: float
    identified: float
    table_2: float
    fitted: float


def fit_physical(records: Sequence[Record]) -> PhysicalFit:
    """Fit Eq. (2) to records jointly: least squares of the error less its mean, within Table 3.

    Args:
        records: tests with known specimen stiffness, at least one of them with k > 0.

    Raises:
        InputError: a record's specimen stiffness is not known.
    """
    errors = ExactErrors(records)
    lower, upper = bounds()

    def error(theta: Array) -> Array:
        parts = np.concatenate([r[0] for r in errors.residuals(theta[None])])
        return np.asarray(parts - parts.mean())

    theta, jacobian, misfit = least(error, TABLE_2, lower, upper)
    # On a bound within what a posterior could see: a millionth of the prior's width.
    at_bound = np.minimum(theta - lower, upper - theta) < 1e-6 * (upper - lower)
    theta = np.where(at_bound & (theta - lower < upper - theta), lower, theta)
    stddev = np.full(4, np.nan)
    free = ~at_bound
    slopes = jacobian[:, free] * TABLE_2[free]  # scaled, so that the inverse is well conditioned
    variance = float(misfit @ misfit) / (len(misfit) - free.sum())
    stddev[free] = np.sqrt(np.diag(np.linalg.inv(slopes.T @ slopes)) * variance) * TABLE_2[free]
    return PhysicalFit(theta, stddev, at_bound, _rms(errors, theta), _rms(errors, TABLE_2))


def least(
    error: Callable[[Array], Array], scale: Array, lower: Array, upper: Array
) -> tuple[Array, Array, Array]:
    """Minimise a sum of squares within bounds.

    Args:
        error: simulation error (n,) [m] of theta (p,).
        scale: starting point and typical size of each parameter, shape (p,), not zero.
        lower: lower bounds, shape (p,).
        upper: upper bounds, shape (p,).

    Returns:
        theta (p,), Jacobian (n, p) and error (n,) at the minimum.
    """

    def in_mm(relative: Array) -> Array:
        return 1e3 * error(relative * scale)

    solution = least_squares(
        in_mm, np.ones(len(scale)), jac='3-point', bounds=(lower / scale, upper / scale),
        xtol=1e-14, ftol=1e-14, gtol=1e-14,
    )  # fmt: skip
    theta = np.clip(solution.x * scale, lower, upper)
    return theta, 1e-3 * np.asarray(solution.jac) / scale, 1e-3 * np.asarray(solution.fun)


def _rms(errors: ExactErrors, theta: Array) -> Array:
    return np.asarray(np.sqrt(errors(theta)[:, 1] / errors.sizes))


def coefficients_beside(theta: Array) -> list[Coefficient]:
    """Return the six identified coefficients beside those of Table 2 and of theta (4,)."""
    rows = []
    for test, stiffness in enumerate(STIFFNESS):
        identified = EQUATION_3[test]
        for i, name in enumerate(('d_1/d_2', 'd_0/d_2', 'n_0/d_2')):
            rows.append(
                Coefficient(
                    name,
                    stiffness,
                    float(identified[i]),
                    float(linear.systems(TABLE_2, stiffness)[0, i]),
                    float(linear.systems(theta, stiffness)[0, i]),
                )
            )
    return rows
