"""An effect that appears while a test runs: when, all at once or slowly, and the data since then.

Eq. (2) must be enough for what comes before, the effect one that would have been seen there, and
both together must explain materially more than effects that act all the time.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from actuator_glue.diagnosis.data import SETTLE, Data, Mask, Model
from actuator_glue.diagnosis.estimate import Json
from actuator_glue.diagnosis.fit import Fit, base_fit
from actuator_glue.diagnosis.score import pooled, splits_of
from actuator_glue.diagnosis.trial import Trial
from actuator_glue.model.linear import systems
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array

_SHORTEST = 5.0  # s on either side
_STEP = 0.25  # s between the times tried at first
_WITHIN = 1.92  # nats: what a 95 % interval of one parameter excludes (Wilks 1938)
_GROWTHS = (0.05, 0.1, 0.2, 0.4, 0.7, 1.0)  # shares of the rest that it may take to grow
_EARLIER = (1.0, 0.75, 0.5, 0.35)
_LEFT_NOISE = 0.6  # structure before it, of the noise, at most


@dataclass(frozen=True, slots=True)
class Onset:
    """When an effect appeared.

    Attributes:
        source: the record in which it appeared.
        time: since that record's first sample [s].
        lower: 95 % profile-likelihood interval of `time`, from [s]; earlier by the loop's delay
        upper: to [s].
        growth: time it took to grow to its size [s]; 0 where it was there at once.
        effects: what appeared; empty where Eq. (2)'s own parameters changed.
    """

    source: str
    time: float
    lower: float
    upper: float
    growth: float
    effects: tuple[str, ...]

    def sentence(self) -> str:
        """Say when and how it appeared, and what the rest of the diagnosis stands on."""
        how = f'over {self.growth:.3g} s' if self.growth > 0.0 else 'at once'
        what = f'{", ".join(self.effects)} appeared' if self.effects else (
            'the parameters of Eq. (2) changed'
        )  # fmt: skip
        return (
            f'{what} {self.time:.2f} s (95 % {self.lower:.2f} to {self.upper:.2f} s) into '
            f'{self.source}, {how}; sizes and errors are those of the data since then'
        )

    def to_json(self) -> Json:
        """Return the JSON object of an onset."""
        return {
            'source': self.source,
            'unit': 's',
            'time': self.time,
            'interval': [self.lower, self.upper],
            'kind': 'growth' if self.growth > 0.0 else 'jump',
            'growth': self.growth,
            'effects': list(self.effects),
        }


@dataclass(frozen=True)
class Moment:
    """A time in a series of records: in which of them, and when since its first sample [s]."""

    record: int
    time: float

    def split(self, data: Data) -> tuple[Data, Data]:
        """Return what counts before and what counts since, with time to settle in between."""
        before, since = [], []
        for i, (record, mask) in enumerate(zip(data.records, data.masks, strict=True)):
            now = record.time
            early = (now < self.time) if i == self.record else np.full(len(mask), i < self.record)
            late = (now >= self.time + SETTLE) if i == self.record else ~early
            before.append(mask & early)
            since.append(mask & late)
        return _of(data, before), _of(data, since)


def _of(data: Data, masks: list[Mask]) -> Data:
    """Return the records of which something counts."""
    use = [i for i, m in enumerate(masks) if m.sum() * data.periods[i] > 1.0]
    return Data(
        tuple(data.records[i] for i in use),
        tuple(masks[i] for i in use),
        tuple(data.initials[i] for i in use),
        tuple(data.recorded[i] for i in use),
        tuple(data.origins[i] for i in use),
        data.prior,
    )


def _counted(data: Data) -> float:
    """Time that counts [s]."""
    pairs = zip(data.masks, data.periods, strict=True)
    return float(sum(m.sum() * period for m, period in pairs))


def change(data: Data, error: Array, jac: Array) -> tuple[Moment, float] | None:
    """Return where a residual changes most: its size, or what parameters it asks for.

    With it by how much less is left of its square sum than without a change.

    Each side has its own parameters, by one Gauss-Newton step, and its own error; the likelihood
    of both is that of two normal variances (Hinkley 1970).

    Args:
        data: what counts.
        error: what a fit leaves (n,), as it is or whitened.
        jac: its derivatives (p, n), likewise.
    """
    size = max(1, round(_STEP / min(data.periods)))
    edges = np.arange(0, len(error), size)
    rows = np.concatenate([jac, error[None]])
    scale = np.sqrt(np.einsum('pn,pn->p', rows, rows))
    rows = rows / np.where(scale > 0.0, scale, 1.0)[:, None]
    blocks = np.array([rows[:, a : a + size] @ rows[:, a : a + size].T for a in edges])
    left = np.cumsum(blocks, axis=0)
    counts = np.minimum(np.arange(1, len(edges) + 1) * size, len(error))
    least = _SHORTEST / min(data.periods)
    best, at, removed = -np.inf, -1, 0.0
    for k in np.flatnonzero((counts > least) & (counts < len(error) - least)):
        early, late = _remaining(left[k]), _remaining(left[-1] - left[k])
        rest = len(error) - counts[k]
        gain = -counts[k] * np.log(early / counts[k]) - rest * np.log(late / rest)
        if gain > best:
            best, at = float(gain), int(counts[k])
            removed = _remaining(left[-1]) - early - late
    if at < 0:
        return None
    index = next(i for i, part in enumerate(data.parts) if part.start <= at < part.stop)
    time = float(data.times[index][at - data.parts[index].start])
    # The rows were scaled to unit size.
    return Moment(index, time), removed * float(scale[-1]) ** 2


def _remaining(normal: Array) -> float:
    """Square sum of an error (the last row) that its Jacobian leaves."""
    cross = normal[:-1, -1]
    solved = np.linalg.lstsq(normal[:-1, :-1], cross, rcond=1e-9)[0]
    return max(float(normal[-1, -1] - cross @ solved), 1e-12)


def quiet_before(moment: Moment, data: Data) -> tuple[Data, Fit] | None:
    """Return what comes before a moment, and Eq. (2) fitted to it, where it leaves noise only.

    What grows slowly begins earlier than it is half grown: some of what comes before is left out
    where that helps.
    """
    if _counted(moment.split(data)[1]) < _SHORTEST:
        return None
    for share in _EARLIER:
        before = Moment(moment.record, share * moment.time).split(data)[0]
        if _counted(before) < _SHORTEST:
            return None
        base = base_fit(before)
        left, noise = pooled(before, splits_of(before, base.error))
        if left <= _LEFT_NOISE * noise:
            return before, base
    return None


def explains(
    sides: tuple[Data, Data],
    base: Fit,
    rivals: tuple[Trial, Trial],
    nats: float,
    material: float,
) -> bool:
    """Whether an effect that appears explains more than effects that act all the time.

    Before the moment the effect must be one that would have been seen.

    Args:
        sides: data before and data since it appeared.
        base: Eq. (2) before it.
        rivals: what acts all the time, and what explains the data since then.
        nats: least evidence for one over the other.
        material: least rms error to be removed [m].
    """
    before, after = sides

    def squares(side: Data, trial: Trial) -> float:
        error = side.target - side.simulate(trial.model, trial.fit.theta)[0]
        return float(error @ error)

    always, appears = rivals
    since = squares(after, appears)
    noise = pooled(after, splits_of(after, appears.fit.error))[1]
    quiet = float(base.error @ base.error)
    gained = squares(before, always) + squares(after, always) - quiet - since
    seen = squares(before, appears) - quiet
    count = before.target.size + after.target.size
    return min(gained, seen) > 2.0 * nats * noise**2 and gained > count * material**2


def dated(data: Data, moment: Moment, base: Fit, found: Trial, noise: float) -> Onset:
    """Return when an effect appeared, by the likelihood of every time near a moment.

    Args:
        data: all that counts.
        moment: about when.
        base: Eq. (2) before it.
        found: what explains the data since then.
        noise: rms of what no structure explains [m].
    """
    i = moment.record
    record, mask = data.records[i], data.masks[i]

    def simulated(model: Model, theta: Array) -> Array:
        start, origin = data.initials[i], data.origins[i]
        return np.asarray(model.simulate(theta[None], record, initial=start, origin=origin)[0])

    off, on = simulated(Structure(()), base.theta), simulated(found.model, found.fit.theta)
    time, target = record.time[mask], record.measured[mask]
    error, step = (target - off[mask]) / noise, (on - off)[mask] / noise
    end = record.duration

    until = np.concatenate([[0.0], np.cumsum(error**2)[:-1]])
    since = np.cumsum(((error - step) ** 2)[::-1])[::-1]
    jump = np.asarray(-0.5 * (until + since), dtype=np.float64)
    best, growth = float(jump.max()), 0.0
    profile: Array = np.asarray(jump)
    times = time
    # A jump may lie anywhere in the gap before the first sample that shows it.
    earliest: Array = np.concatenate([time[:1], time[:-1]])
    coarse: Array = np.asarray(np.arange(0.0, end, _STEP), dtype=np.float64)
    for share in _GROWTHS:
        shapes = (np.clip((time - t) / max(share * (end - t), 1e-9), 0.0, 1.0) for t in coarse)
        slow = [-0.5 * float(np.sum((error - w * step) ** 2)) for w in shapes]
        if max(slow) > best + _WITHIN:
            best, profile, times, earliest = max(slow), np.array(slow), coarse, coarse
            growth = share * (end - float(coarse[int(np.argmax(slow))]))
    inside = np.flatnonzero(profile > best - _WITHIN)
    top = int(np.argmax(profile))
    gap = times[top] - earliest[top] > 1.5 * record.period
    at = float(0.5 * (earliest[top] + times[top]) if gap else times[top])
    margin = _STEP if growth > 0.0 else record.period
    # What acts at the valve shows as late as the loop follows a command: on average by its delay.
    ((a1, a0, _),) = systems(base.theta, record.known_stiffness())
    late = float(a1 / a0)
    return Onset(
        record.source or f'record {i + 1}', at,
        max(0.0, float(earliest[inside[0]]) - margin - late),
        min(end, float(times[inside[-1]]) + margin), growth, found.effects,
    )  # fmt: skip
