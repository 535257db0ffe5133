"""One look at the held-out part: error before and after, intervals, coverage, a sham effect."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from actuator_glue.diagnosis.measured import hum
from actuator_glue.diagnosis.measured.hum import Line
from actuator_glue.diagnosis.posterior.answer_posterior import Side
from actuator_glue.diagnosis.posterior.simulation_spread import spread
from actuator_glue.diagnosis.samples import record_zero
from actuator_glue.diagnosis.score.scorer import BLOCK, pooled, splits_of
from actuator_glue.diagnosis.verdict.held_out import HeldOutError
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.inference.least_squares.fit import rms
from actuator_glue.records import Array

_RESAMPLES = 1000
_NORMAL_95 = 1.959964


class BandCurves(NamedTuple):
    """Simulation of a structure and half width of its 95 % band [m], joined over records."""

    fitted: Array
    fitted_width: Array
    held: Array
    held_width: Array


def bootstrap(
    errors: tuple[Array, Array], floor: float, data: Data, rng: np.random.Generator
) -> list[tuple[float, float]]:
    """95 % block-bootstrap intervals, the same blocks for all of them.

    Args:
        errors: error before and after at the counted samples, (N,) each [m].
        floor: noise of these samples [m].
        data: gives the sample period; blocks last `BLOCK`, longer than a residual is correlated.
        rng: random numbers.

    Returns:
        Intervals of the rms before and after [m], and of the share removed of what exceeds the
        noise.
    """
    length = max(1, round(BLOCK / min(data.periods)))
    edges = np.arange(0, data.target.size, length)
    sizes = np.diff(np.append(edges, data.target.size))
    pick = rng.integers(0, len(edges), (_RESAMPLES, len(edges)))
    counts = sizes[pick].sum(axis=1)
    before, after = (
        np.add.reduceat(error**2, edges)[pick].sum(axis=1) / counts for error in errors
    )
    removable = np.maximum(before - floor**2, 1e-6 * before)
    return [
        (float(low), float(high))
        for low, high in (
            np.quantile(values, [0.025, 0.975])
            for values in (np.sqrt(before), np.sqrt(after), (before - after) / removable)
        )
    ]


def _sham(
    fit: Data,
    held: Data,
    side: Side,
    errors: tuple[Array, Array],
    sizes: tuple[int, int],
    seed: int,
) -> float:
    """Held-out rms after regressing on responses to commands that were never applied.

    Phase-randomised copies of the command run through the same model: as flexible as a real
    effect and as smooth, but knowing nothing of the actuator. Like an effect, the sham is the best
    on the fitting part among as many as were tried.

    Args:
        fit: the fitting part.
        held: the held-out part.
        side: Eq. (2) refitted.
        errors: its error on both parts [m].
        sizes: parameters of a sham, and how many shams are tried.
        seed: seed of the phases.
    """
    count, tried = max(1, sizes[0]), max(1, sizes[1])
    # As many responses as shams: each sham takes `count` neighbouring ones.
    here = _responses(fit, side, max(tried, count), seed)
    commands = [[id(record.command) for record in data.records] for data in (fit, held)]
    folded = commands[0] == commands[1]  # stretches of the same records
    there = here if folded else _responses(held, side, max(tried, count), seed)
    features = [
        np.hstack([rows[:, mask] for rows, mask in zip(found, data.masks, strict=True)])
        for data, found in ((fit, here), (held, there))
    ]
    left, out = np.inf, 0.0
    for first in range(tried):
        use = np.arange(first, first + count) % len(features[0])
        weights, *_ = np.linalg.lstsq(features[0][use].T, errors[0], rcond=1e-6)
        fitted = rms(errors[0] - weights @ features[0][use])
        if fitted < left:
            left, out = fitted, rms(errors[1] - weights @ features[1][use])
    return out


def _responses(data: Data, side: Side, count: int, seed: int) -> list[NDArray[np.float32]]:
    """Responses to phase-randomised copies of each record's command, (count, n) a record [m]."""
    rng = np.random.default_rng([seed, 5])
    out = [np.empty((count, len(record)), dtype=np.float32) for record in data.records]
    spectra = [np.fft.rfft(record.command) for record in data.records]
    for i in range(count):
        for record, spectrum, rows in zip(data.records, spectra, out, strict=True):
            turn = np.exp(2j * np.pi * rng.random(len(spectrum)))
            turn[0] = 0.0  # a mean would do what a bias does
            fake = np.fft.irfft(spectrum * turn, len(record))
            rows[i] = side.model.simulate(side.theta, replace(record, command=fake))
    return out


def noise_floor(fit: Data, held: Data, errors: tuple[Array, Array], fitted: float) -> float:
    """Noise of the held-out part: its stationary residual, limited by the fit's noise [m].

    The limit rises if its records are noisier: noise shows at most frequencies, motion at few.

    Args:
        fit: the fitting part.
        held: the held-out part.
        errors: residuals of one structure in both [m].
        fitted: noise of the fitting part [m].
    """
    known, seen = splits_of(fit, errors[0]), splits_of(held, errors[1])
    here = pooled(held, seen)[1]
    if not fitted > 0.0:
        return here
    louder = [
        np.median(s.psd / np.mean([np.interp(s.frequency, k.frequency, k.psd) for k in known], 0))
        for s in seen
    ]
    sizes = [part.stop - part.start for part in held.parts]
    times = float(np.average(np.maximum(louder, 1.0), weights=sizes))
    return min(here, max(fitted, 1e-12) * float(np.sqrt(times)))


def verify(
    fit: Data,
    held: Data,
    before: Side,
    after: Side,
    noise: float,
    seed: int,
    line: Line | None,
    tried: int,
) -> tuple[HeldOutError, tuple[float, float], tuple[BandCurves, BandCurves]]:
    """Compare both structures on data that decided nothing.

    A line found in the fitting part belongs to the noise here: its phase in the held-out part
    cannot be predicted. The error without it is given separately (`after_without_hum`): its
    frequency is known, two amplitudes per record are regressed, and nothing is decided by it. The
    error without each record's own zero is given, too. `tried` is the number of candidates, and so
    of shams.

    Returns:
        The error, and of before and after the coverage of the 95 % band, and curves for pictures.
    """
    rng = np.random.default_rng([seed, 3])
    noise = float(np.hypot(noise, line.rms)) if line else noise
    sides = before, after
    fitted = [fit.simulate(side.model, side.theta)[0] for side in sides]
    simulated = [held.simulate(side.model, side.theta)[0] for side in sides]
    inner, (was, now) = [fit.target - y for y in fitted], [held.target - y for y in simulated]
    floor = noise_floor(fit, held, (inner[1], now), noise)
    curves, reached = [], None
    for side, here, there in zip(sides, fitted, simulated, strict=True):
        deviation, reached = spread(held, side.model, there, side.draws, rng, reach=side is after)
        wide = _NORMAL_95 * np.sqrt(deviation**2 + floor**2)
        deviation = spread(fit, side.model, here, side.draws, rng)[0]
        curves.append(BandCurves(here, _NORMAL_95 * np.sqrt(deviation**2 + noise**2), there, wide))
    intervals = bootstrap((was, now), floor, held, rng)
    first, last = rms(was), rms(now)
    removable = first**2 - floor**2
    count = len(after.theta) - len(before.theta)
    sham = _sham(fit, held, before, (inner[0], was), (count, tried), seed)
    without_zero = record_zero.without(held, now)
    rows = zip(held.records, held.split(was), held.split(now), strict=True)
    per_record = tuple(
        (record.source or f'record {i + 1}', rms(b), rms(a))
        for i, (record, b, a) in enumerate(rows)
    )
    error = HeldOutError(
        before=first,
        before_ci=intervals[0],
        after=last,
        after_ci=intervals[1],
        noise_floor=floor,
        removable_removed=(first**2 - last**2) / removable if removable > 0 else 0.0,
        removed_ci=intervals[2],
        sham=sham,
        after_without_hum=rms(hum.regressed(held, now, line)) if line else None,
        records=per_record,
        after_without_zero=rms(without_zero),
        zeros=tuple(map(rms, held.split(without_zero))),
        reached=reached,
    )
    covered = [
        float(np.mean(np.abs(e) <= c.held_width)) for e, c in zip((was, now), curves, strict=True)
    ]
    return error, (covered[0], covered[1]), (curves[0], curves[1])
