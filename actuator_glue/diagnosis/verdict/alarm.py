"""The alarm: is there structure in the residual of Eq. (2), and of what kind."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import scipy

from actuator_glue.diagnosis.score.scorer import splits_of
from actuator_glue.diagnosis.search.conclusion import Conclusion
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.inference.least_squares.each import Each
from actuator_glue.inference.noise import Split, structured
from actuator_glue.json_value import JsonObject
from actuator_glue.records import Array

_RESAMPLES = 99
_LAGS = 20


@dataclass(frozen=True, slots=True)
class Alarm(JsonObject):
    """Why (or why not) the model of Eq. (2) is not enough.

    Attributes:
        raised: significant and material.
        structured: rms of the part of the residual that is a function of the command [m].
        threshold: materiality threshold for it [m].
        noise: rms of the rest [m].
        p_value: of the structure under the fitted base model with its own coloured noise.
        false_alarms: probability of any addition on a healthy machine, as asked for.
        nats: evidence that an addition must have at this level.
        tests: further statistics shown to people (whiteness, harmonics, drift, ...).
    """

    raised: bool
    structured: float
    threshold: float
    noise: float
    p_value: float
    false_alarms: float = math.nan
    nats: float = math.nan
    tests: dict[str, float] = field(default_factory=dict)


class StationaryNoise:
    """Gaussian noise with the noise density of a split: the null of the alarm.

    Args:
        part: the split.
        size: samples.
        period: of a sample [s].
    """

    def __init__(self, part: Split, size: int, period: float) -> None:
        self.size, self.period = size, period
        self._whole = scipy.fft.next_fast_len(size, real=True)
        frequency = np.asarray(np.fft.rfftfreq(self._whole, period), dtype=np.float64)
        # One-sided density S: E|X|^2 = S n / (2 T) of the unnormalised transform.
        self._roots = np.sqrt(0.25 * part.density(frequency) * self._whole / period)

    def draw(self, rng: np.random.Generator) -> Array:
        """Return noise (size,) [m]."""
        count = len(self._roots)
        spectrum = self._roots * (rng.standard_normal(count) + 1j * rng.standard_normal(count))
        spectrum[0] = 0.0
        return np.fft.irfft(spectrum, self._whole)[: self.size]


def p_value(data: Data, splits: list[Split], seed: int, each: Each = map) -> float:
    """Bootstrap p-value of the structure of all records under stationary noise."""
    observed = sum(s.structure**2 for s in splits)
    rows = zip(splits, data.parts, data.periods, strict=True)
    null = [StationaryNoise(part, at.stop - at.start, period) for part, at, period in rows]

    def by_chance(number: int) -> float:
        rng = np.random.default_rng([seed, 2, number])
        return sum(structured(noise.draw(rng), noise.period) for noise in null)

    above = sum(total >= observed for total in each(by_chance, range(_RESAMPLES)))
    return (1 + above) / (_RESAMPLES + 1)


def ljung_box(error: Array) -> float:
    """P-value of the first 20 autocorrelations of a residual (n,) under whiteness.

    Lag by lag: a library's correlation over all lags takes time with the square of the length.
    """
    e, n = error - error.mean(), len(error)
    lags = np.arange(1, _LAGS + 1)
    r = np.array([e[k:] @ e[:-k] for k in lags]) / (float(e @ e) or 1.0)
    return float(scipy.stats.chi2.sf(n * (n + 2) * np.sum(r**2 / (n - lags)), _LAGS))


def _even_odd(error: Array, output: Array, velocity: Array) -> tuple[float, float]:
    """Shares of the error explained by even and by odd powers of displacement and velocity."""
    x = output / max(float(np.abs(output).max()), 1e-12)
    v = velocity / max(float(np.abs(velocity).max()), 1e-30)
    even = np.stack([x**2, v**2, x * v, np.abs(x), np.abs(v), np.ones_like(x)])
    odd = np.stack([x**3, v**3, x**2 * v, x * v**2, np.sign(v), x * np.abs(x), v * np.abs(v)])
    shares = []
    for basis in (even, odd):
        weights, *_ = np.linalg.lstsq(basis.T, error, rcond=1e-10)
        shares.append(1.0 - float(np.mean((error - weights @ basis) ** 2) / np.mean(error**2)))
    return shares[0], shares[1]


def statistics(data: Data, error: Array) -> dict[str, float]:
    """Statistics of a residual (N,) [m] that people look at.

    ljung_box_p (smallest over records, 20 lags), input_correlation (largest normalised
    cross-correlation with the command within 0.5 s), even_share and odd_share (of variance),
    trend (m/s, largest).
    """
    out = {
        'ljung_box_p': 1.0,
        'input_correlation': 0.0,
        'even_share': 0.0,
        'odd_share': 0.0,
        'trend': 0.0,
    }
    rows = zip(
        data.records,
        data.masks,
        data.split(error),
        data.split(data.target - error),
        data.split(data.velocity(data.target - error)),
        data.times,
        data.periods,
        strict=True,
    )
    for record, mask, e, y, v, t, period in rows:
        out['ljung_box_p'] = min(out['ljung_box_p'], ljung_box(e))
        u = record.command[mask] - record.command[mask].mean()
        lags = round(0.5 / period)
        cross = scipy.signal.correlate(e - e.mean(), u, mode='same', method='fft')
        near = cross[len(e) // 2 - lags : len(e) // 2 + lags + 1]
        norm = float(np.sqrt(((e - e.mean()) ** 2).sum() * (u**2).sum())) or 1.0
        out['input_correlation'] = max(out['input_correlation'], float(np.abs(near).max()) / norm)
        even, odd = _even_odd(e, y, v)
        out['even_share'] = max(out['even_share'], even)
        out['odd_share'] = max(out['odd_share'], odd)
        slope = float(np.polyfit(t, e, 1)[0])
        if abs(slope) > abs(out['trend']):
            out['trend'] = slope
    return out


def alarm_of(result: Conclusion, level: float, seed: int, each: Each) -> Alarm:
    """Describe the alarm behind the answer of the fitting part.

    Args:
        result: the answer.
        level: probability of a false alarm.
        seed: seed of the bootstrap.
        each: draws several records of noise at a time if it can.
    """
    found, data, error = result.found, result.data, result.found.base.fit.error
    parts = [found.structure, *found.removed.values(), *(m.rms for m in result.seen)]
    return Alarm(
        raised=result.decision.verdict != 'none',
        structured=max(parts),
        threshold=found.material,
        noise=found.noise,
        p_value=p_value(data, splits_of(data, error), seed, each),
        false_alarms=level,
        nats=found.nats,
        tests=statistics(data, error),
    )
