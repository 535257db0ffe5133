"""The stability of a hybrid test watched over one posterior after the other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.hybrid import sampled, stability
from actuator_glue.hybrid.actuator import nonlinear
from actuator_glue.hybrid.compensator import Compensator
from actuator_glue.hybrid.design import Loop
from actuator_glue.hybrid.partition import Partition
from actuator_glue.records import Array

_LIMITS = (0.025, 0.5, 0.975)
_UNUSABLE = 'draws so large or so small that the loop has no roots to compute'
_SKIPPED = 'these draws are not used: look at who publishes them'


@dataclass(frozen=True, slots=True, eq=False)
class Watched:
    """What one posterior says of the loop; three numbers are lower limit, median, upper limit.

    Attributes:
        p_unstable: share of the draws with a growing root.
        warning: whether to warn.
        margin: further delay that the draws bear, (3,) [s].
        growth: real part of the rightmost root, (3,) [1/s].
        delay, amplitude: of the actuator at the frequencies, (3, f) [s, -].
        bandwidth: of the actuator, (3,) [Hz].
        most_sensitive: parameter that the margin follows most; empty where it does not vary.
        left_out: effects that no linear loop has.
        draws: how many were used.
    """

    p_unstable: stability.Share
    warning: bool
    margin: Array
    growth: Array
    delay: Array
    amplitude: Array
    bandwidth: Array
    most_sensitive: str
    left_out: tuple[str, ...]
    draws: int


class MarginWatch:
    """Takes posteriors and warns, with hysteresis, where P(unstable) is too high.

    Args:
        partition: the hybrid test.
        coefficients: of its compensator, factors of target, rate and acceleration, (3,).
        frequencies: where delay and amplitude of the actuator are told [Hz].
        warn_above: P(unstable) from which there is a warning.
        clear_below: P(unstable) below which it ends.
        seed: of the specimens, where the partition spreads them; the same ones for all posteriors.

    Attributes:
        warning: whether there is one.

    Raises:
        InputError: numbers that cannot be used.
    """

    def __init__(
        self,
        partition: Partition,
        coefficients: Sequence[float] = (1.0, 0.0, 0.0),
        frequencies: Sequence[float] = (1.0, 5.0, 10.0),
        *,
        warn_above: float = 0.05,
        clear_below: float = 0.02,
        seed: int = 1,
    ) -> None:
        chosen = np.array(coefficients, dtype=np.float64)
        if chosen.shape != (3,) or not np.isfinite(chosen).all():
            raise InputError(
                f'compensator {list(coefficients)}: give three numbers, the factors of target '
                'displacement, its rate and its acceleration'
            )
        if not 0.0 <= clear_below <= warn_above <= 1.0:
            raise InputError(
                f'clear_below {clear_below:g} and warn_above {warn_above:g} must be in this order '
                'between 0 and 1'
            )
        half = 0.5 * partition.rate
        if not frequencies or not all(0.0 < f <= half for f in frequencies):
            raise InputError(f'frequencies {list(frequencies)} must lie in (0, {half:g}] Hz')
        self.partition = partition
        self.warning = False
        self._compensator = Compensator('inverse', chosen)
        self._frequencies = tuple(frequencies)
        self._levels = clear_below, warn_above
        self._seed = seed

    def take(
        self, draws: Array, names: Sequence[str], effects: Sequence[str], effective: float
    ) -> Watched:
        """Return what draws (m, p) say; `effective` is how many independent ones they are worth.

        Raises:
            InputError: draws that no loop can be made of, or of which nobody knows what they are
                worth; the warning stays as it was.
        """
        _check(draws, names, effective)
        try:
            return self._taken(draws, names, effects, effective)
        except np.linalg.LinAlgError as error:
            raise InputError(f'{_UNUSABLE} ({error}); {_SKIPPED}') from error

    def _taken(
        self, draws: Array, names: Sequence[str], effects: Sequence[str], effective: float
    ) -> Watched:
        rng = np.random.default_rng(self._seed)
        specimen = self.partition.specimen.drawn(rng, len(draws))
        loop = Loop.of(self.partition, draws, names, effects, specimen)
        period, chosen = self.partition.period, self._compensator
        growth = sampled.growth(loop.numerical, loop.plants, chosen.coefficients, period)
        if np.isnan(growth).any():
            # NaN is not above zero: such a draw would count as stable.
            raise InputError(f'{_UNUSABLE}; {_SKIPPED}')
        open_loop = stability.loops(self.partition, specimen, loop.actuators.system, chosen)
        delay = loop.actuators.delay + self.partition.computation_delay
        margin = stability.signed_margin(open_loop, period, delay, growth > 0.0)
        tracking = stability.tracking(loop.actuators, self._frequencies)
        share = stability.share(growth > 0.0, effective)
        clear, warn = self._levels
        self.warning = share.value >= (clear if self.warning else warn) and share.value > 0.0
        inputs = {name: draws[:, i] for i, name in enumerate(names)}
        inputs |= {f'specimen {name}': column for name, column in specimen.items()}
        sensitive = stability.sensitivity(margin, inputs)
        return Watched(
            share,
            self.warning,
            # Where nothing limits the delay there is nothing between two infinities.
            np.asarray(np.quantile(margin, _LIMITS, method='nearest'), np.float64),
            _interval(growth),
            _interval(tracking.delay),
            _interval(tracking.amplitude),
            _interval(tracking.bandwidth),
            max(sensitive, key=lambda name: abs(sensitive[name]), default=''),
            nonlinear(effects),
            len(draws),
        )


def _check(draws: Array, names: Sequence[str], effective: float) -> None:
    bad = ~np.isfinite(draws)
    if bad.any():
        row, column = (int(at) for at in np.argwhere(bad)[0])
        raise InputError(
            f'{int(bad.any(axis=1).sum())} of {len(draws)} draws are NaN or infinite, the first '
            f'in {names[column]} of draw {row}; {_SKIPPED}'
        )
    if np.isnan(effective):
        raise InputError(
            f'ess_min of {len(draws)} draws is NaN: without it P(unstable) has no interval; '
            f'{_SKIPPED}'
        )


def _interval(values: Array) -> Array:
    return np.asarray(np.quantile(values, _LIMITS, axis=0), np.float64)
