"""Sums of simulation errors of Eq. (2) at a cost that does not grow with the record's length.

The response is expanded in a discrete Laguerre basis filtered over the command once per window;
what is left per theta is a small quadratic form. Derivation and error bound: docs/fast_path.md.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from actuator_glue.jit import njit
from actuator_glue.model import kernel, linear, reference
from actuator_glue.model.exact import ExactErrors, Initial
from actuator_glue.model.fast import gram, laguerre, quadratic
from actuator_glue.records import Array, Record

TOLERANCE = 3e-9  # relative error of the sum of squares; times G = 256 it is 8e-7 in L
# Terms of the basis, and the factor by which damping and frequency may be off the reference's with
# them. Less where the record begins in motion: such a window is one of many, whose preparation
# time counts.
_FEWEST, _MOST, _MOST_MOVING = 16, 128, 96
_MARGIN, _MARGIN_MOVING = 1.4, 1.2
_ENOUGH = 1e-11  # what the terms should leave of the response
_APART = 5.0  # the sections' poles over their geometric mean, at most


class JoinedSamples(NamedTuple):
    """The samples of all records one after another, for compiled loops.

    Attributes:
        measured: shape (n_1 + ... + n_R,) [m].
        command: two samples longer per record (`linear.padded`) [m].
        first: where each record begins in `measured`, and the end, shape (R + 1,).
        starts: initial position and velocity of each record, shape (R, 2) [m, m/s].
        settle: its uncounted samples, shape (R,).
    """

    measured: Array
    command: Array
    first: NDArray[np.int64]
    starts: Array
    settle: NDArray[np.int64]


class FastErrors:
    """Errors of Eq. (2a) like `ExactErrors`, by a small quadratic form per theta.

    Each theta's error bound is checked; where it exceeds the tolerance the exact kernel is used.
    So results agree with `ExactErrors` within the tolerance for every theta.

    Args:
        records: tests fitted jointly, each with a known specimen stiffness.
        settle: samples at each record's beginning that are simulated but not counted.
        initial: state at the first sample: 'rest', or 'measured' from the first samples.
        tolerance: bound on the relative error of each record's sum of squares about its mean.
        near: theta (4,) close to the best fit where one is known, as from the window before;
            saves the search for the system that the basis is built around.

    Attributes:
        rows: quadratic forms of the records, one row each, for compiled loops.
        fallbacks: record-theta pairs that the exact kernel did, over all calls.

    Raises:
        InputError: as `ExactErrors`.
    """

    def __init__(
        self,
        records: Sequence[Record],
        settle: Sequence[int] | int = 0,
        initial: Initial = 'rest',
        tolerance: float = TOLERANCE,
        near: ArrayLike | None = None,
    ) -> None:
        self.exact = ExactErrors(records, settle, initial)
        self.tolerance = tolerance
        self.fallbacks = 0
        rows = [_row(self.exact, r, near) for r in range(len(self.exact.records))]
        self.rows = rows[0][np.newaxis]
        if len(rows) > 1:
            self.rows = _aligned(len(rows), max(len(row) for row in rows))
            for wide, row in zip(self.rows, rows, strict=True):
                wide[: len(row)] = row

    @cached_property
    def samples(self) -> JoinedSamples:
        """What the exact kernel needs."""
        exact = self.exact
        return JoinedSamples(
            np.concatenate([record.measured for record in exact.records]),
            np.concatenate(exact.padded),
            np.cumsum([0, *(len(record) for record in exact.records)]),
            np.array(exact.starts),
            np.array(exact.settle),
        )

    @property
    def sizes(self) -> NDArray[np.int64]:
        """Counted samples of every record, shape (R,)."""
        return self.exact.sizes

    def __call__(self, theta: ArrayLike) -> Array:
        """Return (sum of e, sum of e^2) per theta and record, (R, 2) or (m, R, 2) [m, m^2].

        Raises:
            InputError: theta is not (4,) or (m, 4).
        """
        table = linear.thetas(theta)
        count = len(self.rows)
        out = np.empty((len(table), count, 2))
        slack = np.empty((count, len(table)))
        if quadratic.evaluate_all(self.rows, table, self.tolerance, out, slack):
            self.fallbacks += int(np.count_nonzero(slack))
            for r in range(count):
                which = np.flatnonzero(slack[r])
                systems = linear.systems(table[which], self.exact.stiffness[r])
                out[which, r] = self.exact.of_record(r, systems)
        return out if np.ndim(theta) == 2 else out[0]

    def residuals(self, theta: ArrayLike) -> list[Array]:
        """Return the counted errors of every record, shape (n_r,) or (m, n_r) each [m].

        Raises:
            InputError: theta is not (4,) or (m, 4).
        """
        return self.exact.residuals(theta)


def _aligned(count: int, width: int) -> Array:
    """Return zeros (count, width) that begin where a line of the cache does."""
    room = np.zeros(count * width + laguerre.BLOCK)
    first = -(room.ctypes.data // room.itemsize) % laguerre.BLOCK
    return room[first : first + count * width].reshape(count, width)


def _row(exact: ExactErrors, r: int, near: ArrayLike | None) -> Array:
    """Return everything about one record that the quadratic form needs."""
    record, (x0, v0) = exact.records[r], exact.starts[r]
    foh = record.hold == 'linear'
    system = np.full(3, np.nan) if near is None else linear.systems(near, exact.stiffness[r])[0]
    if not (np.isfinite(system).all() and (system > 0.0).all()):
        system = reference.fit(record, exact.settle[r], exact.starts[r])
    u0 = record.command[0] if foh else 0.0
    moving = bool(x0 or v0 or u0)
    slow, fast = _sections(system[0], system[1])
    pole, pole_2 = (1.0 + math.expm1(-min(s * record.period, 5.0)) for s in (slow, fast))
    delta, delta_2 = 1.0 - pole, 1.0 - pole_2  # exactly: else the sections would not be lossless
    margin, most = (_MARGIN_MOVING, _MOST_MOVING) if moving else (_MARGIN, _MOST)
    K = _terms(system[0], system[1], margin, most)
    header = {
        laguerre.TERMS: K,
        laguerre.FREE: moving,
        laguerre.STIFFNESS: exact.stiffness[r],
        laguerre.PERIOD: record.period,
        laguerre.FOH: foh,
        laguerre.POLE: pole,
        laguerre.DELTA: delta,
        laguerre.POLE_2: pole_2,
        laguerre.DELTA_2: delta_2,
        laguerre.SHIFT: (delta_2 - delta) / (delta + delta_2 - delta * delta_2),
        laguerre.X0: x0,
        laguerre.V0: v0,
        laguerre.U0: u0,
    }
    dims = K * (1 + moving)
    width = laguerre.HEADER + (K + laguerre.TAIL) * (1 + moving) + dims * (2 + dims)
    row: Array = _aligned(1, width)[0]
    for column, value in header.items():
        row[column] = value
    c = kernel.discretise(system[np.newaxis], record.period, foh)[0]
    gram.prepare(row, c, record.measured, record.command, exact.settle[r])
    return row


@njit
def _sections(a1: float, a0: float) -> tuple[float, float]:
    """Return where the sections' poles s = -sigma best lie for systems near one: (2,) [1/s].

    On its own poles where they are real, but not further apart than is of use.
    """
    middle, half = math.sqrt(a0), 0.5 * a1
    if half <= middle:
        return middle, middle
    slow = max(middle * middle / (half + math.sqrt(half * half - a0)), middle / _APART)
    return slow, a0 / slow


@njit
def _terms(a1: float, a0: float, margin: float, most: int) -> int:
    """Return the number of terms that poles near the reference system's need.

    A pole p leaves the product of both sections' |(p - sigma)/(p + sigma)| per two terms; the
    worst of systems with damping a1 and frequency within the margin is taken.
    """
    (slow, fast), worst = _sections(a1, a0), 0.0
    for damping in (1.0 / margin, 1.0, margin):
        for stiffness in (1.0 / margin, 1.0, margin):
            half = 0.5 * a1 * damping
            root = cmath.sqrt(half * half - a0 * stiffness)
            for pole in (root - half, -root - half):
                two = (pole + slow) * (pole + fast) / ((pole - slow) * (pole - fast))
                worst = max(worst, abs(two))
    wanted = 2.0 * math.log(_ENOUGH) / math.log(worst) if 0.0 < worst < 1.0 else float(most)
    return laguerre.BLOCK * math.ceil(min(max(wanted, _FEWEST), most) / laguerre.BLOCK)
