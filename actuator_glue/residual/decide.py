"""The verdict: none, missing-effect or unexplained, and where an unexplained rest sits."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from actuator_glue.records import Array
from actuator_glue.residual.attribute import Attribution
from actuator_glue.residual.data import Data
from actuator_glue.residual.diagnosis import Verdict
from actuator_glue.residual.estimate import Json
from actuator_glue.residual.measurement import Measured
from actuator_glue.residual.score import splits_of
from actuator_glue.residual.search import Trial
from actuator_glue.residual.settings import Settings
from actuator_glue.residual.surrogate import Surrogate


@dataclass(frozen=True)
class Decision:
    """Verdict on the fitting part.

    Attributes:
        verdict: see Diagnosis.
        final: structure to go on with.
        names: its effects, named as findings.
        measured: measurement effects, named as findings.
        noise: rms of what no structure explains [m].
        left: rms structure that remains, without what measurement effects cause [m].
        certainty: what the names' probabilities are multiplied with: the share of the structure
            explained where much remains, else 1.
        limit: rms structure above which a model counts as unexplained [m].
        remaining: where the rest sits, for the JSON.
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
    found: Attribution,
    seen: tuple[Measured, ...],
    data: Data,
    settings: Settings,
    surrogate: Surrogate,
) -> Decision:
    """Weigh what was found against what remains.

    Names that a generic surrogate of as many parameters beats beyond chance stand only where
    next to nothing remains: what a regression on the motion explains better than they do is not
    their doing, even where they remove most of it. A machine that lacks three effects and more
    lacks others too, and a regression finds some of them: its names are then held to the share
    that one or two effects are held to, and fall where the regression leaves nothing material.
    """
    variance = sum(m.rms**2 for m in seen if m.name != 'hum')
    left = float(np.sqrt(max(0.0, found.left**2 - variance)))
    many = sum(gain >= found.material for gain in found.removed.values()) > 2
    beaten = bool(found.final.effects) and surrogate.beats(found.material, settings.nats)
    share = settings.left_share_many if many and not beaten else settings.left_share
    limit = max(settings.left_noise * found.noise, found.material, share * found.structure)
    rest = max(0.0, surrogate.error**2 - found.noise**2)
    if beaten and (not many or rest < found.material**2):
        floor = max(settings.beaten_noise * found.noise, settings.beaten_share * found.structure)
        limit = min(limit, floor)
    verdict: Verdict = 'none'
    if left > limit:
        verdict = 'unexplained'
    elif found.final.effects or seen:
        verdict = 'missing-effect'
    # Several effects that explain most of it are worth going on with; what remains is said.
    partly = verdict == 'unexplained' and many and not beaten
    partly = partly and left < settings.left_share_partly * found.structure
    named = verdict == 'missing-effect' or partly
    final = found.final if named else found.base
    return Decision(
        verdict=verdict,
        final=final,
        names=final.effects,
        measured=seen if named else (),
        noise=found.noise,
        left=left,
        certainty=1.0 - (left / found.structure) ** 2 if partly else 1.0,
        limit=limit,
        remaining={'left': left, 'limit': limit, **remaining(data, final.fit.error)},
    )


def _band(frequency: Array, excess: Array) -> list[float]:
    """Return the band that holds the middle 80 % of the structure's power [Hz]."""
    power = np.cumsum(np.maximum(excess, 0.0))
    if power[-1] <= 0.0:
        return []
    low, high = np.searchsorted(power, [0.1 * power[-1], 0.9 * power[-1]])
    return [round(float(frequency[low]), 2), round(float(frequency[high]), 2)]


def remaining(data: Data, error: Array) -> Json:
    """Say where in time, frequency, amplitude and velocity a residual sits, per record."""
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
