"""The standard normal distribution, compiled: its distribution function and the inverse."""

from __future__ import annotations

import math

from actuator_glue.jit import njit

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


# Strict floating point: the same bits wherever it is inlined.
@njit(fastmath=False)
def below(z: float) -> float:
    """Return the share of a standard normal distribution below z."""
    return 0.5 * math.erfc(-z * math.sqrt(0.5))


@njit(fastmath=False)
def _polynomial(c: tuple[float, ...], x: float) -> float:
    high = ((c[7] * x + c[6]) * x + c[5]) * x + c[4]
    return (((high * x + c[3]) * x + c[2]) * x + c[1]) * x + c[0]


@njit(fastmath=False)
def quantile(share: float) -> float:
    """Return the standard normal number below which lies `share`, in +-6.66: inverse of `below`.

    To draw one so takes a quarter of the time of logarithms and sines (Box and Muller).
    """
    q = share - 0.5
    if abs(q) <= 0.425:
        r = 0.180625 - q * q
        return q * _polynomial(_MIDDLE[0], r) / _polynomial(_MIDDLE[1], r)
    tail = max(min(share, 1.0 - share), _LEAST)
    r = math.sqrt(-math.log(tail)) - 1.6
    far = _polynomial(_TAIL[0], r) / _polynomial(_TAIL[1], r)
    return far if q > 0.0 else -far
