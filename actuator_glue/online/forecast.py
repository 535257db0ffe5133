"""Bands of a frozen posterior over samples it has not seen, and their coverage afterwards."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

import numpy as np

from actuator_glue.inference.bands import Band, band
from actuator_glue.inference.choice import ModelChoice
from actuator_glue.inference.predictive import ResidualModel
from actuator_glue.online.mixture import mixture_band
from actuator_glue.records import Array, Record

# PARAMETER holds the spread of the parameters, TOTAL adds what the model left over in its window
# (honest about a model that lacks something), NOISE adds the sensor's noise only: measurements
# fall out of it as soon as the model lacks something, which is what raises an alarm.
Kind: TypeAlias = Literal['parameter', 'total', 'noise']

TINY = 1e-12  # m; a residual is never exactly nothing


@dataclass(frozen=True, slots=True, eq=False)
class FrozenPosterior:
    """A posterior as it stood when its window closed, kept until later samples judge it.

    Attributes:
        number: number of the window.
        segment: contiguous piece of the stream it belongs to.
        start: running index of the first sample it forecasts.
        stop: running index one past the last.
        model: model of the draws.
        draws: posterior draws, shape (m, p).
        residual: residual of the best draw in its window [m].
        noise: standard deviation of the sensor noise [m].
        past: last samples of its window, from which its responses continue: nothing measured
            after the window's end enters a forecast, whenever it is computed.
        weight: weight of the model among those that are carried, when the window closed.
        beside: posteriors of the other structures carried.
    """

    number: int
    segment: int
    start: int
    stop: int
    model: ModelChoice
    draws: Array
    residual: ResidualModel
    noise: float
    past: Record
    weight: float = 1.0
    beside: tuple[FrozenPosterior, ...] = ()

    @property
    def parts(self) -> tuple[FrozenPosterior, ...]:
        """The posteriors of all structures, each cut to its share of the draws."""
        if not self.beside:
            return (self,)
        total = self.weight + sum(one.weight for one in self.beside)
        found = []
        for one in (self, *self.beside):
            wanted = round(one.weight / total * len(one.draws))
            rows = np.linspace(0, len(one.draws) - 1, wanted).astype(np.intp)
            if wanted:
                found.append(replace(one, draws=one.draws[rows], beside=()))
        return tuple(found)

    @property
    def end(self) -> int:
        """Running index one past the last sample of its window."""
        return self.past.first_index + len(self.past)


@dataclass(frozen=True, slots=True, eq=False)
class WindowPrediction:
    """One band over consecutive samples.

    Attributes:
        number: window whose posterior made it.
        index: running index of its first sample.
        stamp_ns: acquisition time of its first sample [ns].
        period: time between samples [s].
        kind: what the band holds.
        band: limits and median [m].
        width: mean width per level, shape (L,) [m].
        coverage: share of measured samples inside per level, shape (L,); None until measured.
        rms_error: rms of measured minus median [m]; NaN until measured.
    """

    number: int
    index: int
    stamp_ns: int
    period: float
    kind: Kind
    band: Band
    width: Array
    coverage: Array | None = None
    rms_error: float = float('nan')


def predictions(
    frozen: FrozenPosterior,
    responses: Sequence[Array],
    *,
    levels: tuple[float, ...],
    seed: int,
    measured: Array | None = None,
) -> list[WindowPrediction]:
    """Return the bands of a frozen posterior over its forecast, scored where it was measured.

    The bands do not depend on whether they are scored: what is scored is what was published.

    Args:
        frozen: the posterior.
        responses: of each draw of its `parts` over the forecast, shapes (m, n) [m].
        levels: probability of each band.
        seed: of the estimator; with the forecast's first index it seeds the residual's draws.
        measured: the samples, shape (n,) [m], where they are known by now.
    """
    rng = np.random.default_rng((seed, frozen.start, 1))
    told = []
    for part, rows in zip(frozen.parts, responses, strict=True):
        finite = rows if np.isfinite(rows).all() else rows[np.isfinite(rows).all(axis=1)]
        noise = np.full(len(finite), max(part.noise, TINY))
        told.append((finite, *part.residual.levels(rng, len(finite)), noise))
    simulated, mean, sd, sensor = told[0]
    if len(told) > 1:
        simulated, mean, sd, sensor = map(np.concatenate, zip(*told, strict=True))
    if len(simulated) < 2:
        return []
    bands: list[tuple[Kind, Band]] = [
        ('parameter', band(simulated, levels)),
        ('total', mixture_band(simulated, mean, np.maximum(sd, TINY), levels)),
        ('noise', mixture_band(simulated, mean, sensor, levels)),
    ]
    past = frozen.past
    stamp_ns = past.stamp_ns(frozen.start - past.first_index)
    found = []
    for kind, limits in bands:
        inside, error = None, float('nan')
        if measured is not None:
            covered = (limits.lower <= measured) & (measured <= limits.upper)
            inside = np.asarray(covered.mean(axis=1))
            error = float(np.sqrt(np.mean((measured - limits.median) ** 2)))
        width = np.asarray((limits.upper - limits.lower).mean(axis=1))
        found.append(
            WindowPrediction(
                number=frozen.number,
                index=frozen.start,
                stamp_ns=stamp_ns,
                period=past.period,
                kind=kind,
                band=limits,
                width=width,
                coverage=inside,
                rms_error=error,
            )
        )
    return found
