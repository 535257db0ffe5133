"""Linear systems with one input and one output, many side by side: one for each draw."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from actuator_glue.records import Array

Complex = NDArray[np.complex128]
_ON_AXIS = 1e-5  # |real part| / |eigenvalue| of a crossing that rounding has moved off the axis


class System(NamedTuple):
    """x' = A x + B u, y = C x + D u; shapes (m, n, n), (m, n), (m, n), (m,)."""

    A: Array
    B: Array
    C: Array
    D: Array

    def response(self, s: Complex) -> Complex:
        """Return C (s I - A)^-1 B + D at points s (m, k), shape (m, k)."""
        n = self.A.shape[1]
        matrix = s[..., None, None] * np.eye(n) - self.A[:, None]
        right = np.broadcast_to(self.B[:, None, :, None], (*s.shape, n, 1))
        inner = np.linalg.solve(matrix, right)[..., 0]
        return np.asarray((inner * self.C[:, None]).sum(axis=2) + self.D[:, None])

    def phase(self, w: Array, response: Complex) -> Array:
        """Return the phase at angular frequencies with all its turns, (m, k) [rad].

        Continuous from rest up, whatever frequencies are asked for: no grid that a sharp resonance
        could slip through. From j 0 to j w each pole turns by less than half a turn, which its own
        angle tells; the sum says by how many turns the angle of the response is short. Exact where
        zeros turn it by less than half a turn in all, and the static gain is positive: an actuator
        has no zeros.

        Args:
            w: angular frequencies, shape (k,) [rad/s].
            response: what `response` gives there, (m, k).
        """
        poles = np.linalg.eigvals(self.A)[:, None]
        lag = np.angle((1j * w[:, None] - poles) * -poles.conj()).sum(axis=2)
        angle = np.angle(response)
        return np.asarray(angle - 2.0 * np.pi * np.rint((angle + lag) / (2.0 * np.pi)))


def series(first: System, second: System) -> System:
    """Return the second system fed by the first; one row may meet many."""
    m = max(len(first.D), len(second.D))
    a, b = (System(*(np.broadcast_to(x, (m, *x.shape[1:])) for x in s)) for s in (first, second))
    p, q = a.A.shape[1], b.A.shape[1]
    A = np.zeros((m, p + q, p + q))
    A[:, :p, :p], A[:, p:, p:] = a.A, b.A
    A[:, p:, :p] = b.B[:, :, None] * a.C[:, None]
    return System(
        A,
        np.concatenate([a.B, b.B * a.D[:, None]], axis=1),
        np.concatenate([b.D[:, None] * a.C, b.C], axis=1),
        a.D * b.D,
    )


def closed(loop: System) -> Array:
    """Return the state matrix (m, n, n) with the output fed back negatively."""
    return loop.A - loop.B[:, :, None] * (loop.C / (1.0 + loop.D)[:, None])[:, None]


def crossings(system: System) -> Array:
    """Return every angular frequency at which the gain is 1, (m, 2n) [rad/s]; NaN fills the rows.

    The gain of a system is 1 at w exactly where j w is an eigenvalue of its Hamiltonian matrix
    (Boyd, Balakrishnan and Kabamba 1989): no frequency grid that a sharp resonance could slip
    through.
    """
    R = (1.0 - system.D**2)[:, None, None]
    R = np.where(R == 0.0, np.finfo(np.float64).eps, R)  # a gain of 1 at infinity crosses nowhere
    BD = system.B * system.D[:, None]
    A = system.A + BD[:, :, None] * system.C[:, None] / R
    BB = system.B[:, :, None] * system.B[:, None] / R
    CC = system.C[:, :, None] * system.C[:, None] / R
    H = np.concatenate(
        [np.concatenate([A, BB], axis=2), np.concatenate([-CC, -A.swapaxes(1, 2)], axis=2)], axis=1
    )
    roots = np.linalg.eigvals(H)
    at = (np.abs(roots.real) <= _ON_AXIS * np.abs(roots)) & (roots.imag > 0.0)
    return np.where(at, roots.imag, np.nan)


def held(system: System, period: float, delay: Array | float = 0.0) -> System:
    """Return the exact discrete system whose input is held over each period, after a delay.

    Args:
        system: the continuous one; where there is a delay, with D = 0.
        period: sample period T [s].
        delay: of the input, >= 0, shape () or (m,) [s]; a part of a period counts as such (the
            modified z-transform), whole periods become states.
    """
    m, n = system.B.shape
    lag = np.broadcast_to(np.asarray(delay, dtype=np.float64) / period, (m,))
    whole = np.floor(lag + 1e-9).astype(np.intp)
    part = np.maximum(lag - whole, 0.0)
    states, late = _transition(system, (1.0 - part) * period)
    before, early = _transition(system, part * period)
    early = (states @ early[..., None])[..., 0]
    register = int(whole.max()) + (1 if (part > 0.0).any() else 0)
    A = np.zeros((m, n + register, n + register))
    A[:, :n, :n] = states @ before
    inputs = np.zeros((m, n, register + 2))  # from the sample now, from the one before, ...
    rows = np.arange(m)
    inputs[rows, :, whole] = late
    inputs[rows, :, whole + 1] += early
    A[:, :n, n:] = inputs[:, :, 1 : register + 1]
    B = np.zeros((m, n + register))
    B[:, :n] = inputs[:, :, 0]
    if register:
        B[:, n] = 1.0
        A[:, np.arange(n + 1, n + register), np.arange(n, n + register - 1)] = 1.0
    return System(A, B, np.pad(system.C, ((0, 0), (0, register))), system.D)


def _transition(system: System, times: Array) -> tuple[Array, Array]:
    """Return exp(A t) and its integral times B, each system with its own t [s]."""
    m, n = system.B.shape
    block = np.zeros((m, n + 1, n + 1))
    block[:, :n, :n], block[:, :n, n] = system.A, system.B
    out = np.asarray(scipy.linalg.expm(block * times[:, None, None]))
    return out[:, :n, :n], out[:, :n, n]


def bilinear(system: System) -> System:
    """Return the continuous system with the gain of a discrete one, at w = tan(angle of z / 2)."""
    inverse = np.linalg.inv(system.A + np.eye(system.A.shape[1]))
    right = (inverse @ system.B[..., None])[..., 0]
    left = (system.C[:, None] @ inverse)[:, 0]
    root = np.sqrt(2.0)
    D = system.D - (system.C * right).sum(axis=1)
    A = (system.A - np.eye(system.A.shape[1])) @ inverse
    return System(A, root * right, root * left, D)
