"""When an actuator was changed: dates proposed by a segmentation, judged by a Bayes factor."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.special import logsumexp

from actuator_glue.campaigns.day_model import log_likelihoods
from actuator_glue.campaigns.rows import needed
from actuator_glue.campaigns.series import Series
from actuator_glue.records import Array

# Changes that are expected of an actuator in a year before any is seen.
A_YEAR = 1.0
# A change is told from this probability on.
TOLD = 0.5
# Days of test around a proposed one among which the date is looked for.
_AROUND = 8
# The last day alone is no change: it may be its own offset.
_LEAST = 3
_MOST = 20
_YEAR = 365.25


@dataclass(frozen=True, slots=True)
class ChangePoint:
    """One change.

    Attributes:
        place: number of the first day of test after it.
        day: date of that day.
        earliest, latest: first days after it, 95 % of the probability.
        probability: that there was a change, some parameter's, between these days.
        parameters: probability that it moved each parameter.
    """

    place: int
    day: str
    earliest: str
    latest: str
    probability: float
    parameters: dict[str, float]

    @property
    def moved(self) -> tuple[str, ...]:
        """The parameters that it moved, as likely as not."""
        return tuple(n for n, p in self.parameters.items() if p >= TOLD)


def change_points(series: Series) -> tuple[ChangePoint, ...]:
    """Return the changes of an actuator that are as likely as not, by date.

    A segmentation (PELT of `ruptures`) proposes dates. Each is judged by the evidence of a jump
    there, over walk and offsets of the days, of each parameter with even odds, against none;
    before, `A_YEAR` changes are expected in a year. The likeliest is taken, then all again.
    """
    proposed = _proposed(series)
    taken: list[int] = []
    found: dict[int, ChangePoint] = {}
    while len(taken) < _MOST:
        left = [k for k in proposed if all(abs(k - t) >= _LEAST for t in taken)]
        best = _likeliest(series, left, taken)
        if best is None or best.probability < TOLD:
            break
        taken.append(best.place)
        found[best.place] = best
    return tuple(found[k] for k in sorted(found))


def _proposed(series: Series) -> list[int]:
    """Return places before which a piecewise constant level may jump: more than there are."""
    ruptures: Any = needed('ruptures', 'the history of an actuator')
    n = len(series.days)
    if n < 2 * _LEAST:
        return []
    deviations = np.sqrt(np.diagonal(series.covariance, axis1=1, axis2=2))
    # Differences of neighbours tell the scatter of days, whatever jumps there are.
    steps = np.median(np.abs(np.diff(series.mean, axis=0)), axis=0) / (0.6745 * np.sqrt(2.0))
    signal = series.mean / np.maximum(np.maximum(steps, np.median(deviations, axis=0)), 1e-12)
    places: set[int] = set()
    for column in signal.T:
        one = np.ascontiguousarray((column - column.mean())[:, None])
        # Squared deviations from the mean of each stretch, as `Pelt(model='l2')` has them.
        fitted = ruptures.KernelCPD(kernel='linear', min_size=_LEAST).fit(one)
        places |= set(fitted.predict(pen=2.0 * np.log(n))[:-1])
    return sorted(places)


def _likeliest(series: Series, proposed: list[int], taken: list[int]) -> ChangePoint | None:
    n = len(series.days)
    near = sorted(
        {
            k
            for place in proposed
            for k in range(place - _AROUND, place + _AROUND + 1)
            if _LEAST <= k <= n - _LEAST and all(abs(k - t) >= _LEAST for t in taken)
        }
    )
    if not near:
        return None
    places = np.array(near)
    factors = np.array([_log_factors(series, i, taken, near) for i in range(len(series.names))])
    # Each parameter moves or not, with even odds.
    every = np.logaddexp(0.0, factors).sum(axis=0) - len(factors) * np.log(2.0)
    expected = A_YEAR * np.diff(series.times)[places - 1] / _YEAR
    odds = every + np.log(np.maximum(expected, 1e-12))
    best = int(np.argmax(odds))
    window = np.abs(places - places[best]) <= _AROUND
    total = float(logsumexp(odds[window]))
    shares = np.exp(odds[window] - total)
    where = places[window]
    low, high = (where[int(np.searchsorted(np.cumsum(shares), q))] for q in (0.025, 0.975))
    place = int(places[best])
    return ChangePoint(
        place=place,
        day=series.days[place],
        earliest=series.days[int(low)],
        latest=series.days[min(int(high), n - 1)],
        probability=float(1.0 / (1.0 + np.exp(-min(total, 700.0)))),
        parameters={
            name: float(1.0 / (1.0 + np.exp(-np.clip(factors[i, best], -700.0, 700.0))))
            for i, name in enumerate(series.names)
        },
    )


def _log_factors(series: Series, i: int, taken: list[int], places: list[int]) -> Array:
    """Return the log Bayes factor of a jump of one parameter at each place (m,), over none."""
    y, s = series.mean[:, i], np.sqrt(series.covariance[:, i, i])
    evidence = logsumexp(log_likelihoods(series.times, y, s, taken, places), axis=1)
    return np.asarray(evidence[1:] - evidence[0])
