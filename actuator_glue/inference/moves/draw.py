"""Uniforms turned into archive indices, classes and normals."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from actuator_glue.jit import njit
from actuator_glue.records import Array


@njit
def distinct(
    uniforms: Array, first: int, count: int, size: int, indices: NDArray[np.int64]
) -> None:
    """Write an ordered sample of range(size) without replacement into indices[0, :count].

    A Fisher-Yates shuffle of which only the first entries are made: position indices[1, m] holds
    indices[2, m] instead of its own number. indices has shape (3, >= count).
    """
    for k in range(count):
        position = k + int(uniforms[first + k] * (size - k))
        here = position
        mine = k
        for m in range(k):
            if indices[1, m] == position:
                here = indices[2, m]
            if indices[1, m] == k:
                mine = indices[2, m]
        indices[0, k] = here
        indices[1, k] = position
        indices[2, k] = mine


@njit
def choose(uniform: float, cumulative: Array) -> int:
    """Return the class that a uniform falls into, given cumulative probabilities."""
    k = 0
    while k < cumulative.size - 1 and uniform >= cumulative[k]:
        k += 1
    return k


# Wichura (1988), algorithm AS 241, PPND16: numerator and denominator, near the middle and in the
# tails, lowest power first.
_MIDDLE = (
    (3.3871328727963666080e0, 1.3314166789178437745e2, 1.9715909503065514427e3,
     1.3731693765509461125e4, 4.5921953931549871457e4, 6.7265770927008700853e4,
     3.3430575583588128105e4, 2.5090809287301226727e3),
    (1.0, 4.2313330701600911252e1, 6.8718700749205790830e2, 5.3941960214247511077e3,
     2.1213794301586595867e4, 3.9307895800092710610e4, 2.8729085735721942674e4,
     5.2264952788528545610e3),
)  # fmt: skip
_TAIL = (
    (1.42343711074968357734e0, 4.63033784615654529590e0, 5.76949722146069140550e0,
     3.64784832476320460504e0, 1.27045825245236838258e0, 2.41780725177450611770e-1,
     2.27238449892691845833e-2, 7.74545014278341407640e-4),
    (1.0, 2.05319162663775882187e0, 1.67638483018380384940e0, 6.89767334985100004550e-1,
     1.48103976427480074590e-1, 1.51986665636164571966e-2, 5.47593808499534494600e-4,
     1.05075007164441684324e-9),
)  # fmt: skip
_LEAST = 1.4e-11  # of a tail: 6.66 standard deviations, beyond which there are other constants


@njit
def _polynomial(c: tuple[float, ...], x: float) -> float:
    high = ((c[7] * x + c[6]) * x + c[5]) * x + c[4]
    return (((high * x + c[3]) * x + c[2]) * x + c[1]) * x + c[0]


@njit
def normal(uniform: float) -> float:
    """Return the standard normal number below which lies the share `uniform`, in +-6.66.

    A quarter of the time that logarithms and sines take (Box and Muller).
    """
    q = uniform - 0.5
    if abs(q) <= 0.425:
        r = 0.180625 - q * q
        return q * _polynomial(_MIDDLE[0], r) / _polynomial(_MIDDLE[1], r)
    tail = max(min(uniform, 1.0 - uniform), _LEAST)
    r = math.sqrt(-math.log(tail)) - 1.6
    far = _polynomial(_TAIL[0], r) / _polynomial(_TAIL[1], r)
    return far if q > 0.0 else -far
