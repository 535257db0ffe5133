"""The verdict on the fitting part, and where the unexplained residual lies."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from actuator_glue.diagnosis.estimate import Json
from actuator_glue.diagnosis.learned.term import any_learned, is_learned
from actuator_glue.diagnosis.measured.measurement import Measured
from actuator_glue.diagnosis.score.regression import Surrogate
from actuator_glue.diagnosis.score.scorer import splits_of
from actuator_glue.diagnosis.selection import Selection
from actuator_glue.diagnosis.thresholds import Thresholds
from actuator_glue.diagnosis.trial import Trial
from actuator_glue.diagnosis.verdicts import Verdict
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.records import Array


@dataclass(frozen=True)
class Decision:
    """Verdict on the fitting part.

    Attributes:
        verdict: see `DiagnosisData`.
        final: structure to go on with: all additions that are supported.
        names: its effects, named as findings.
        measured: measurement effects, named as findings.
        noise: rms of what no structure explains [m].
        left: rms structure that remains, without what measurement effects cause [m].
        certainty: where structure remains, the share of it that the names explain and a generic
            regression does not explain better; else 1.
        limit: rms structure above which a model counts as unexplained [m].
        remaining: where the unexplained residual lies, for the JSON.
    """

    verdict: Verdict
    final: Trial
    names: tuple[str, ...]
    measured: tuple[Measured, ...]
    noise: float
    left: float
    certainty: float
    limit: float
    remaining: Json


def decide(
    found: Selection,
    seen: tuple[Measured, ...],
    data: Data,
    settings: Thresholds,
    surrogate: Surrogate,
) -> Decision:
    """Decide whether the effects found explain everything.

    Which additions are supported was decided one by one, each on its own evidence and size; they
    stay whatever remains beside them. Where a generic surrogate with as many parameters beats the
    names beyond chance, next to nothing may remain: they do not cause a structure that a
    regression on the motion explains better.
    """
    variance = sum(m.rms**2 for m in seen if m.name != 'hum')
    left = float(np.sqrt(max(0.0, found.left**2 - variance)))
    limit = max(
        settings.left_noise * found.noise, found.material, settings.left_share * found.structure
    )
    if found.final.effects and surrogate.beats(found.material, settings.nats):
        floor = max(settings.beaten_noise * found.noise, settings.beaten_share * found.structure)
        limit = min(limit, floor)
    verdict: Verdict = 'none'
    if left > limit:
        verdict = 'unexplained'
    elif found.final.effects or seen:
        verdict = 'missing-effect'
    final = found.final
    doubted = verdict == 'unexplained' or (
        any_learned(found.final.structure) and left >= found.material
    )
    return Decision(
        verdict=verdict,
        final=final,
        names=final.effects,
        measured=seen,
        noise=found.noise,
        left=left,
        certainty=_certainty(found, left, surrogate) if doubted else 1.0,
        limit=limit,
        remaining={'left': left, 'limit': limit, **remaining(data, final.fit.error)},
    )


def _certainty(found: Selection, left: float, surrogate: Surrogate) -> float:
    """Return the share of the structure that the names are likely to cause, in [0, 1].

    The share that they explain, times what a regression with as many parameters leaves relative
    to what they leave: if a smooth function of the motion does much better, the names only stand
    for it. What a learned term explains does not count as theirs.
    """
    # Not relative to the structure found at first: under a stationary command most of it passes
    # for noise until something explains it.
    gained = max(0.0, found.base.mean_square - found.final.mean_square)
    terms = [e.name for e in found.final.structure.entries if is_learned(e)]
    named = max(0.0, gained - sum(found.removed[n] ** 2 for n in terms))
    explained = named / (gained + left**2) if gained > 0.0 else 0.0
    theirs = surrogate.structure_error**2 - found.noise**2
    generic = max(0.0, surrogate.error**2 - found.noise**2)
    return explained * (min(1.0, generic / theirs) if theirs > 0.0 else 1.0)


def _band(frequency: Array, excess: Array) -> list[float]:
    """Return the band that holds the middle 80 % of the structure's power [Hz]."""
    power = np.cumsum(np.maximum(excess, 0.0))
    if power[-1] <= 0.0:
        return []
    low, high = np.searchsorted(power, [0.1 * power[-1], 0.9 * power[-1]])
    return [round(float(frequency[low]), 2), round(float(frequency[high]), 2)]


def remaining(data: Data, error: Array) -> Json:
    """Say where in time, frequency, amplitude and velocity a residual (N,) lies, per record."""
    rows = []
    splits, errors = splits_of(data, error), data.split(error)
    outputs = data.split(data.target - error)
    for i, (record, part, e, y, t, period) in enumerate(
        zip(data.records, splits, errors, outputs, data.times, data.periods, strict=True)
    ):
        excess = np.maximum(e**2 - part.noise**2, 0.0)
        total = float(excess.sum()) or 1.0
        cumulated = np.cumsum(excess)
        inner = np.searchsorted(cumulated, [0.1 * cumulated[-1], 0.9 * cumulated[-1]])
        velocity = np.abs(np.gradient(y, period))
        slow = velocity < np.median(velocity)
        amplitude = np.abs(y - np.median(y))
        large = amplitude > np.median(amplitude)
        order = np.argsort(amplitude)
        ranked = np.cumsum(excess[order])
        sizes = np.searchsorted(ranked, [0.1 * ranked[-1], 0.9 * ranked[-1]])
        rows.append(
            {
                'source': record.source or f'record {i + 1}',
                'stiffness': record.known_stiffness(),
                'structure': part.structure,
                'noise': part.noise,
                'frequency_hz': _band(part.frequency, part.excess),
                'time_s': [round(float(t[min(j, len(t) - 1)]), 2) for j in inner],
                'displacement': [float(amplitude[order[min(j, len(y) - 1)]]) for j in sizes],
                'share_at_low_velocity': round(float(excess[slow].sum()) / total, 3),
                'share_at_large_displacement': round(float(excess[large].sum()) / total, 3),
            }
        )
    return {'unit': 'm', 'records': rows}
