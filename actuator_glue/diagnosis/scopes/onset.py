"""When an effect appeared while a test ran, and whether at once or slowly."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from actuator_glue.diagnosis.scopes.change import Change
from actuator_glue.diagnosis.scopes.moments import Moment
from actuator_glue.diagnosis.trial import Trial
from actuator_glue.inference.least_squares.data import Data, Mask
from actuator_glue.json_value import Json
from actuator_glue.model.linear import systems
from actuator_glue.model.parameters import BASE
from actuator_glue.records import Array, Record, source_names

_STEP = 0.25  # s between the times tried where it grows
_WITHIN = 1.92  # nats: what a 95 % interval of one parameter excludes (Wilks 1938)
_FADED = 7.0  # time constants after which the loop's own motion is no more
_SWINGS = 10.0  # nats that the loop's own motion after a jump must gain, more for many times tried
_GROWTHS = (0.05, 0.1, 0.2, 0.4, 0.7, 1.0)  # shares of the rest that it may take to grow


@dataclass(frozen=True, slots=True)
class Onset:
    """When an effect appeared.

    Attributes:
        source: the record in which it appeared.
        time: since that record's first sample [s].
        lower: start of the 95 % profile-likelihood interval of `time` [s], less the loop's delay.
        upper: its end [s].
        growth: time it took to grow to its size [s]; 0 where it was there at once.
        effects: what appeared; empty where parameters changed, of Eq. (2) or of an effect.
        before: effects that were there before.
        change: the one thing that changed, where Eq. (2) holds on both sides and one thing is
            enough.
    """

    source: str
    time: float
    lower: float
    upper: float
    growth: float
    effects: tuple[str, ...]
    before: tuple[str, ...] = ()
    change: Change | None = None

    def sentence(self) -> str:
        """Say when and how it appeared, and what the rest of the diagnosis stands on."""
        how = f'over {self.growth:.3g} s' if self.growth > 0.0 else 'at once'
        what = f'{", ".join(self.effects)} appeared' if self.effects else (
            f'the parameters of Eq. (2){" or of an effect" if self.before else ""} changed'
        )  # fmt: skip
        if self.change is not None:
            what += f', {self.change.sentence()} and nothing else,'
        before = f', beside {", ".join(self.before)},' if self.before else ''
        return (
            f'{what}{before} {self.time:.2f} s (95 % {self.lower:.2f} to {self.upper:.2f} s) into '
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
            'before': list(self.before),
            'change': self.change.to_json() if self.change else None,
        }


@dataclass(frozen=True)
class Appeared:
    """What is known of an onset before it is dated.

    Attributes:
        data: all counted samples, before and since.
        moment: its approximate time.
        before: the structure that is enough before it.
        held: held-out records, from which the name of its record tells that, too.
    """

    data: Data
    moment: Moment
    before: Trial
    held: tuple[Record, ...] = ()

    @property
    def scope(self) -> str:
        """Scope of the effects found since then."""
        record = self.data.records[self.moment.record]
        called = source_names(r.source for r in (*self.data.records, *self.held))
        name = called[record.source] or f'record {self.moment.record + 1}'
        return f'since {self.moment.time:.1f} s of {name}'


def dated(appeared: Appeared, found: Trial, noise: float) -> Onset:
    """Return when something appeared, by the likelihood of every time of its record.

    Args:
        appeared: what is known of it.
        found: what explains the data since then.
        noise: rms of what no structure explains [m].
    """
    data, before, i = appeared.data, appeared.before, appeared.moment.record
    record, mask = data.records[i], data.masks[i]

    def simulated(trial: Trial) -> Array:
        start, origin, theta = data.initials[i], data.origins[i], trial.fit.theta[None]
        return np.asarray(trial.model.simulate(theta, record, initial=start, origin=origin)[0])

    off, on = simulated(before), simulated(found)
    time, target = record.time[mask], record.measured[mask]
    error, step = (target - off[mask]) / noise, (on - off)[mask] / noise
    end = record.duration

    until = np.concatenate([[0.0], np.cumsum(error**2)[:-1]])
    since = np.cumsum(((error - step) ** 2)[::-1])[::-1]
    jump = np.asarray(-0.5 * (until + since), dtype=np.float64)
    # An effect at the valve shows later, on average by the loop's delay in following a command.
    ((a1, a0, _),) = systems(before.fit.theta[: len(BASE)], record.known_stiffness())
    late = float(a1 / a0)
    swings = _swings(error - step, mask, record.period, (1.0, float(a1), float(a0)))
    likely = jump > jump.max() - _WITHIN
    if float((jump + swings).max() - jump.max()) > _SWINGS + np.log(len(jump)):
        # Whether it begins with the swing is not known: the interval covers both cases.
        jump = jump + swings
        likely |= jump > jump.max() - _WITHIN
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
            likely = profile > best - _WITHIN
            growth = share * (end - float(coarse[int(np.argmax(slow))]))
    inside = np.flatnonzero(likely)
    top = int(np.argmax(profile))
    gap = times[top] - earliest[top] > 1.5 * record.period
    at = float(0.5 * (earliest[top] + times[top]) if gap else times[top])
    margin = _STEP if growth > 0.0 else record.period
    return Onset(
        record.source or f'record {i + 1}', at,
        max(0.0, float(earliest[inside[0]]) - margin - late),
        min(end, float(times[inside[-1]]) + margin), growth,
        tuple(name for name in found.effects if name not in before.effects), before.effects,
    )  # fmt: skip


def _swings(rest: Array, mask: Mask, period: float, loop: tuple[float, ...]) -> Array:
    """Nats that a free swing of the loop, of any size, explains after each counted sample (N,).

    A sudden change leaves the loop in a state that is not the changed machine's: it swings into
    that as it does from rest.

    Args:
        rest: residual of the changed machine at the counted samples (N,), over the noise.
        mask: which samples count (n,).
        period: time between samples [s].
        loop: its characteristic polynomial in seconds.
    """
    first, second = np.roots(loop).astype(complex)
    until = min(period * len(mask), -_FADED / max(first.real, second.real))
    now = np.arange(0.0, max(until, 2.0 * period), period)
    slow = np.exp(first * now)
    modes = np.stack([slow.real, slow.imag if slow.imag.any() else np.exp(second * now).real])
    full, seen = np.zeros(len(mask)), mask.astype(np.float64)
    full[mask] = rest

    def sums(kernel: Array, signal: Array) -> Array:
        padded = np.concatenate([signal, np.zeros(len(kernel) - 1)])
        return np.asarray(scipy.signal.correlate(padded, kernel, mode='valid')[mask])

    pull = np.stack([sums(mode, full) for mode in modes], axis=1)
    normal = np.stack([sums(a * b, seen) for a in modes for b in modes], axis=1).reshape(-1, 2, 2)
    normal += 1e-9 * float(np.abs(normal).max()) * np.eye(2)
    moved = np.linalg.solve(normal, pull[..., None])[..., 0]
    return np.asarray(0.5 * np.einsum('np,np->n', pull, moved))
