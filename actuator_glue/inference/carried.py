"""Knowledge of parameters carried from one test to the next, as draws."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.records import Array

# As many draws as pin a mixture's covariances to a few percent, and still fit into a message.
DRAWS = 800
# What gain-drift moves, and how fast; a gain that would reach zero stays above this.
_GAIN, _DRIFT, _LEAST_GAIN = 'alpha_1_beta_0', 'gain_drift', 1e-3
# Fewer say nothing about a covariance.
FEWEST = 50


@dataclass(frozen=True, eq=False)
class Carried:
    """Draws of an earlier posterior, from which a prior is made.

    Attributes:
        names: the parameters.
        draws: shape (m, p), SI units.
        components: normal components of the prior.
        spread: standard deviation by which the logarithm of each parameter may have moved since.
        factor: what the covariance is multiplied by, after it was contradicted.

    Raises:
        InputError: too few draws, or draws that are not finite or do not fit the names.
    """

    names: tuple[str, ...]
    draws: Array
    components: int = 1
    spread: tuple[float, ...] = ()
    factor: float = 1.0

    def __post_init__(self) -> None:
        draws = self.draws
        if not self.spread:
            object.__setattr__(self, 'spread', (0.0,) * len(self.names))
        if draws.ndim != 2 or draws.shape[1] != len(self.names) or len(draws) < FEWEST:
            raise InputError(
                f'a prior needs draws ({FEWEST} or more, {len(self.names)}) of '
                f'{", ".join(self.names)}, got shape {draws.shape}'
            )
        if not np.isfinite(draws).all():
            raise InputError('the draws of a prior are not all finite')

    @staticmethod
    def thinned(names: Sequence[str], draws: Array) -> Carried:
        """Return at most `DRAWS` of the draws (m, p), spread evenly."""
        chosen = np.linspace(0, len(draws) - 1, min(DRAWS, len(draws))).astype(np.intp)
        return Carried(tuple(names), np.ascontiguousarray(draws[chosen]))

    @cached_property
    def key(self) -> bytes:
        """Digest that is the same for equal draws."""
        words = repr((self.names, self.components)).encode()
        return hashlib.blake2b(words + self.draws.tobytes(), digest_size=16).digest()

    def __hash__(self) -> int:
        return hash((self.key, self.spread, self.factor))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Carried) and (self.key, self.spread, self.factor) == (
            other.key,
            other.spread,
            other.factor,
        )

    def only(self, names: Sequence[str]) -> Carried:
        """Return what is known of some of the parameters by themselves.

        Args:
            names: of them, in any order.
        """
        at = [self.names.index(name) for name in names]
        spread = tuple(self.spread[i] for i in at)
        return replace(self, names=tuple(names), draws=self.draws[:, at], spread=spread)

    def drifted(self, drift: Drift, seconds: float) -> Carried:
        """Return what is known so much later [s]: a random walk of each parameter's logarithm."""
        hours = max(seconds, 0.0) / 3600.0
        steps = [drift.rate(name) * np.sqrt(hours) for name in self.names]
        return replace(self, spread=tuple(float(s) for s in np.hypot(self.spread, steps)))

    def later(self, seconds: float) -> Carried:
        """Return the same for a record that begins so much later [s]; see `later`."""
        draws = later(self.names, self.draws, seconds)
        return self if draws is self.draws else replace(self, draws=draws)

    def widened(self, factor: float) -> Carried:
        """Return the same with `factor` times the variance."""
        return replace(self, factor=self.factor * factor)

    def points(self, count: int, rng: np.random.Generator) -> Array:
        """Return draws (count, p) of what is known now."""
        found = self.draws[rng.integers(len(self.draws), size=count)]
        middle = self.draws.mean(axis=0)
        found = middle + np.sqrt(self.factor) * (found - middle)
        return np.asarray(found * np.exp(self.spread * rng.standard_normal(found.shape)))

    def to_json(self) -> dict[str, Any]:
        """Return a JSON object from which `from_json` makes the same bits."""
        return {
            'names': list(self.names),
            'draws': self.draws.tolist(),
            'components': self.components,
            'spread': list(self.spread),
            'factor': self.factor,
        }

    @staticmethod
    def from_json(value: Any, source: str = '') -> Carried:
        """Return what `to_json` wrote.

        Raises:
            InputError: it is no such object.
        """
        try:
            names = tuple(str(name) for name in value['names'])
            draws, spread = np.array(value['draws'], np.float64), value['spread']
            return Carried(
                names,
                draws,
                int(value['components']),
                tuple(float(s) for s in spread),
                float(value['factor']),
            )
        except (KeyError, TypeError, ValueError) as error:
            raise InputError(f'{source}: the carried prior cannot be read ({error})') from error


def later(names: tuple[str, ...], draws: Array, seconds: float) -> Array:
    """Return draws (m, p) for a record that begins so much later [s].

    A gain that drifts counts from the beginning of its record: 1 + r (t + s) is
    (1 + r s)(1 + r/(1 + r s) t).
    """
    if _GAIN not in names or _DRIFT not in names or seconds == 0.0:
        return draws
    gain, rate = names.index(_GAIN), names.index(_DRIFT)
    out = draws.copy()
    grown = np.maximum(1.0 + out[:, rate] * seconds, _LEAST_GAIN)
    out[:, gain] *= grown
    out[:, rate] /= grown
    return out


@dataclass(frozen=True, slots=True)
class Drift:
    """How far parameters wander: standard deviation of ln x after one hour, a random walk.

    Attributes:
        every: rate of each parameter that has none of its own [1/sqrt(h)].
        own: rates by parameter [1/sqrt(h)].

    Raises:
        InputError: a rate that is negative or not finite.
    """

    every: float = 0.0
    own: tuple[tuple[str, float], ...] = ()

    def __post_init__(self) -> None:
        for name, rate in (('every parameter', self.every), *self.own):
            if not 0.0 <= rate <= 100.0:
                raise InputError(
                    f'drift of {name} is {rate:g}; 0 to 100 per square root of an hour'
                )

    @staticmethod
    def of(every: float, own: Mapping[str, float] | None = None) -> Drift:
        """Return the drift with rates of their own by parameter."""
        return Drift(every, tuple(sorted((own or {}).items())))

    def rate(self, name: str) -> float:
        """Return the rate of a parameter [1/sqrt(h)]."""
        return dict(self.own).get(name, self.every)
