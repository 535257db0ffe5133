"""The moment at which an effect may have appeared, and what may hold before it.

Eq. (2) or effects that always act must be enough for the data before.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from actuator_glue.diagnosis.score.scorer import structure_and_noise
from actuator_glue.diagnosis.score.weights import log_weight
from actuator_glue.diagnosis.thresholds import LEFT_NOISE, MATTERING
from actuator_glue.diagnosis.trial import Trial
from actuator_glue.inference.least_squares.data import SETTLE, Data, Mask
from actuator_glue.inference.least_squares.fit import Fit, base_fit, fit
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array

SHORTEST = 5.0  # s on either side
HELD = 1.0  # s of held-out data after it, at least: without any, nothing can be verified
_STEP = 0.25  # s between the times tried
_EARLIER = (1.0, 0.75, 0.5, 0.35)


@dataclass(frozen=True)
class Moment:
    """A time in a series of records: index of the record, and time since its first sample [s]."""

    record: int
    time: float

    def near(self, other: Moment) -> bool:
        """Whether another moment is of the same record and too near to count separately."""
        return self.record == other.record and abs(self.time - other.time) < 2.0 * SETTLE

    def inside(self, data: Data) -> bool:
        """Whether it is away from both ends of its record, where records may differ instead."""
        end = data.records[self.record].duration
        return SHORTEST < self.time < end - SHORTEST

    def split(self, data: Data) -> tuple[Data, Data]:
        """Return the counted data before and since, with time to settle in between."""
        before, since = [], []
        for i, (record, mask) in enumerate(zip(data.records, data.masks, strict=True)):
            now = record.time
            early = (now < self.time) if i == self.record else np.full(len(mask), i < self.record)
            late = (now >= self.time + SETTLE) if i == self.record else ~early
            before.append(mask & early)
            since.append(mask & late)
        return _of(data, before), _of(data, since)


def _of(data: Data, masks: list[Mask]) -> Data:
    """Return the records of which more than a second counts, with these masks."""
    use = [i for i, m in enumerate(masks) if m.sum() * data.periods[i] > 1.0]
    return Data(
        tuple(data.records[i] for i in use),
        tuple(masks[i] for i in use),
        tuple(data.initials[i] for i in use),
        tuple(data.recorded[i] for i in use),
        tuple(data.origins[i] for i in use),
        data.prior,
        steps=tuple(data.steps[i] for i in use),
    )


def counted(data: Data) -> float:
    """Time that counts [s]."""
    pairs = zip(data.masks, data.periods, strict=True)
    return float(sum(m.sum() * period for m, period in pairs))


def changes(data: Data, error: Array, jac: Array) -> Iterator[tuple[Moment, float]]:
    """Yield the moments at which a residual changes most, in its size or its best parameters.

    With each, by how much the change lowers the sum of squares. The best of all may be a
    difference between records, near the end of one, and an effect that shows only in the fast part
    of one record hides an onset in another: so the best moment inside of each record follows.

    Each side has its own parameters, by one Gauss-Newton step, and its own error; the likelihood
    of both is that of two normal variances (Hinkley 1970).

    Args:
        data: the counted samples.
        error: residual of a fit (N,), plain or whitened.
        jac: its derivatives (p, N), likewise.
    """
    size = max(1, round(_STEP / min(data.periods)))
    edges = np.arange(0, len(error), size)
    rows = np.concatenate([jac, error[None]])
    scale = np.sqrt(np.einsum('pn,pn->p', rows, rows))
    rows = rows / np.where(scale > 0.0, scale, 1.0)[:, None]
    blocks = np.array([rows[:, a : a + size] @ rows[:, a : a + size].T for a in edges])
    left = np.cumsum(blocks, axis=0)
    counts = np.minimum(np.arange(1, len(edges) + 1) * size, len(error))
    least = SHORTEST / min(data.periods)
    tried = np.flatnonzero((counts > least) & (counts < len(error) - least))
    gains, removed = np.full(len(edges), -np.inf), np.zeros(len(edges))
    for k in tried:
        early, late = _remaining(left[k]), _remaining(left[-1] - left[k])
        rest = len(error) - counts[k]
        gains[k] = -counts[k] * np.log(early / counts[k]) - rest * np.log(late / rest)
        removed[k] = _remaining(left[-1]) - early - late
    best = [int(np.argmax(gains)), *_inside(data, counts, gains)]
    for k in dict.fromkeys(best):
        if np.isfinite(gains[k]):
            at = int(counts[k])
            index = next(i for i, part in enumerate(data.parts) if part.start <= at < part.stop)
            time = float(data.times[index][at - data.parts[index].start])
            # The rows were scaled to unit size.
            yield Moment(index, time), removed[k] * float(scale[-1]) ** 2


def _inside(data: Data, counts: NDArray[np.intp], gains: Array) -> list[int]:
    """Return the index of the largest gain inside of each record, larger gains first."""
    best = []
    for part, period in zip(data.parts, data.periods, strict=True):
        least = SHORTEST / period
        inside = (counts > part.start + least) & (counts < part.stop - least)
        best.append(int(np.argmax(np.where(inside, gains, -np.inf))))
    return sorted(best, key=lambda k: -gains[k])


def _remaining(normal: Array) -> float:
    """Square sum of an error (the last row) that its Jacobian leaves."""
    cross = normal[:-1, -1]
    solved = np.linalg.lstsq(normal[:-1, :-1], cross, rcond=1e-9)[0]
    return max(float(normal[-1, -1] - cross @ solved), 1e-12)


def quiet_before(moment: Moment, data: Data) -> tuple[Data, Fit] | None:
    """Return the data before a moment, and Eq. (2) fitted to them, where it leaves noise only.

    An effect that grows slowly begins earlier than it is half grown: the last of these data are
    left out where that helps.
    """
    for share in _EARLIER:
        before = Moment(moment.record, share * moment.time).split(data)[0]
        if counted(before) < SHORTEST:
            return None
        base = base_fit(before)
        if quiet(before, base.error):
            return before, base
    return None


def quiet(before: Data, error: Array) -> bool:
    """Whether what a fit leaves of the data before a moment is noise."""
    left, noise = structure_and_noise(before, error)
    return left <= LEFT_NOISE * noise


def enough_before(
    before: Data, base: Trial | None, since: Trial, material: float, complete: bool
) -> list[tuple[Trial, float]]:
    """Return models that may hold before a moment, best first: Eq. (2), or `since` less an effect.

    Or `since` with other parameters, where it is complete and leaves only noise there, too.

    Structure before the moment may pass for noise until its cause is known. Effects that always
    act have the same parameters on either side: else each side is a fit of its own, and any two
    fits leave less than one.

    Args:
        before: data before the moment.
        base: Eq. (2), where it was enough there; None: only models that leave noise only count.
        since: what explains the data since then.
        material: least rms error that matters [m].
        complete: whether `since` leaves nothing material.

    Returns:
        Each with the additional rms error before the moment of its parameters since then [m].
    """
    tried = [] if base is None else [(base, 0.0)]
    entries = since.structure.entries if since.own is None else ()
    for gone in entries:
        model = Structure(e for e in entries if e is not gone)
        kept = np.delete(since.fit.theta, since.structure.columns(gone.name))
        again = fit(before, model, kept)
        if base is None and not quiet(before, again.error):
            continue
        more = before.target - before.simulate(model, kept)[0]
        excess = float(np.sqrt(np.maximum(np.mean(more**2) - again.rms**2, 0.0)))
        tried.append((Trial(model, '', again, np.zeros(0)), excess))
    if complete and entries:
        again = fit(before, since.structure, since.fit.theta)
        if quiet(before, again.error):
            tried.append((Trial(since.structure, '', again, np.zeros(0)), 0.0))

    def weight(side: tuple[Trial, float]) -> float:
        found = side[0].fit
        return log_weight(found.rms, MATTERING * material, len(found.theta))

    return sorted(tried, key=weight, reverse=True)
