"""Which posteriors are pressed against a bound of their prior."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from actuator_glue.inference.moments import PRIOR_DOMINATED
from actuator_glue.records import Array

# Width of the strip at a bound, in standard deviations of the posterior, and the least mass there
# over that of a flat posterior of the same spread: a normal one is reported where its bound lies
# within about 1.2 standard deviations, and in a thousand draws never by chance at 3.
_STRIP = 0.25
_FLAT = 0.5

Side: TypeAlias = Literal['lower', 'upper']


@dataclass(frozen=True, slots=True)
class Pressed:
    """A posterior that a bound of the prior holds.

    Attributes:
        name: parameter.
        side: which bound.
        bound: its value [unit of the parameter].
        physical: the parameter cannot lie beyond it: zero where negative has no meaning.
        share: posterior mass in the strip beside the bound, a quarter of the posterior's
            standard deviation wide.
        flat_share: mass there of a flat posterior of the same standard deviation.
    """

    name: str
    side: Side
    bound: float
    physical: bool
    share: float
    flat_share: float

    def to_json(self) -> dict[str, object]:
        """Return the JSON object."""
        return {
            'name': self.name,
            'bound': self.side,
            'value': self.bound,
            'physical': self.physical,
            'share': self.share,
            'flat_share': self.flat_share,
        }


def pressed(
    draws: Array, names: tuple[str, ...], lower: ArrayLike, upper: ArrayLike
) -> tuple[Pressed, ...]:
    """Return the parameters whose posterior does not fall off towards a bound.

    A posterior that is mostly prior reaches its bounds by nature and is left out: the data say
    little of it (`moments.prior_dominated`). One without any spread, all draws at the bound, is
    pressed against it.

    Args:
        draws: posterior draws, shape (m, p), in coordinates in which the prior is uniform.
        names: parameters, p of them.
        lower: lower bounds of the prior, shape (p,).
        upper: upper bounds, shape (p,).
    """
    low, high = np.asarray(lower, np.float64), np.asarray(upper, np.float64)
    flat = _STRIP / np.sqrt(12.0)
    found = []
    for i, name in enumerate(names):
        column, width = draws[:, i], float(high[i] - low[i])
        spread = float(column.std())
        if spread > PRIOR_DOMINATED * width / np.sqrt(12.0):
            continue
        strip = max(_STRIP * spread, 1e-9 * width)
        shares: tuple[tuple[Side, float, float], ...] = (
            ('lower', float(low[i]), float(np.mean(column <= low[i] + strip))),
            ('upper', float(high[i]), float(np.mean(column >= high[i] - strip))),
        )
        for side, bound, share in shares:
            if share > _FLAT * flat:
                physical = side == 'lower' and bound == 0.0
                found.append(Pressed(name, side, bound, physical, share, flat))
    return tuple(found)
