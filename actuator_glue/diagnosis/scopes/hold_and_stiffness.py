"""The set-up that was given, and whether another one explains the records far better.

Stiffnesses that were given to the wrong records, the wrong hold of the command between its
samples, or a displacement that runs ahead of its command look like a machine that is far from
Eq. (2). Where Eq. (2) explains far more under another set-up, that is said before anything else.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from actuator_glue.diagnosis.score import forecast
from actuator_glue.diagnosis.score.scorer import Scorer, evidence, splits_of, structure_and_noise
from actuator_glue.diagnosis.score.weights import log_weight
from actuator_glue.diagnosis.thresholds import MATTERING, NATS, SETUP_FAR, least_material
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.inference.least_squares.fit import Fit, base_fit, fit
from actuator_glue.inference.least_squares.stretches import stretches
from actuator_glue.json_value import JsonObject
from actuator_glue.model.effects import CATALOGUE, scale
from actuator_glue.model.structure import Structure
from actuator_glue.records import Hold, source_names

_RUNS = {
    'linear': 'running linearly between its samples (--hold linear)',
    'zoh': 'held between its samples (--hold zoh)',
}
LEAD = 'lead'
_MOST = 6  # with up to so many records, any two may have been exchanged


@dataclass(frozen=True, slots=True)
class WrongSetup(JsonObject):
    """Another set-up under which Eq. (2) explains the records far better.

    Attributes:
        sources: names of the records.
        stiffness: the specimen stiffness of each record under it [N/m].
        hold: how the command of each record runs between its samples under it.
        changed: what is not as given: 'stiffness', 'hold' or both; or 'lead'.
        error: rms error of Eq. (2) refitted under it [m].
        as_given: rms error of Eq. (2) refitted under the set-up that was given [m].
        enough: whether Eq. (2) alone leaves nothing under it that matters.
        taken: whether the diagnosis is one under it; else it is one as given.
        lead: time by which the displacement runs ahead of its command under it [s].
    """

    sources: tuple[str, ...]
    stiffness: tuple[float, ...]
    hold: tuple[Hold, ...]
    changed: tuple[str, ...]
    error: float
    as_given: float
    enough: bool
    taken: bool = False
    lead: float = 0.0

    @classmethod
    def between(
        cls,
        given: Data,
        other: Data,
        errors: tuple[float, float],
        enough: bool,
        taken: bool = False,
        lead: float = 0.0,
    ) -> WrongSetup:
        """Return what differs between the set-up of some data and another one of the same.

        Args:
            given: the data as given.
            other: the same data under the other set-up.
            errors: rms errors of Eq. (2), refitted as given and under the other one [m].
            enough: as the attribute.
            taken: as the attribute.
            lead: as the attribute [s].
        """
        was, now = given.recorded, other.recorded
        changed = {
            'stiffness': any(a.stiffness != b.stiffness for a, b in zip(was, now, strict=True)),
            'hold': any(a.hold != b.hold for a, b in zip(was, now, strict=True)),
            LEAD: lead > 0.0,
        }
        return cls(
            sources=tuple(r.source or f'record {i + 1}' for i, r in enumerate(was)),
            stiffness=tuple(r.known_stiffness() for r in now),
            hold=tuple(r.hold for r in now),
            changed=tuple(name for name, is_other in changed.items() if is_other),
            error=errors[1],
            as_given=errors[0],
            enough=enough,
            taken=taken,
            lead=lead,
        )

    @property
    def runs_linearly(self) -> bool:
        """Whether it differs in one thing: the command runs linearly and was given as held."""
        return self.changed == ('hold',) and 'linear' in self.hold

    @property
    def leads(self) -> bool:
        """Whether it differs in one thing: the displacement runs ahead of its command."""
        return self.changed == (LEAD,)

    def options(self) -> tuple[str, ...]:
        """Return the words of the command line for it, beside the stiffnesses."""
        if self.leads:
            return '--effect', LEAD
        holds = tuple(dict.fromkeys(self.hold))
        return ('--hold', *holds) if len(holds) == 1 and 'hold' in self.changed else ()

    def sentence(self) -> str:
        """Say what to check, or what was taken instead."""
        parts = []
        if 'stiffness' in self.changed:
            pairs = zip(self.sources, self.stiffness, strict=True)
            called = source_names(self.sources)
            order = ', '.join(f'{k:g} N/m for {called[s]}' for s, k in pairs)
            parts.append(f'specimen stiffnesses exchanged ({order})')
        if 'hold' in self.changed:
            parts.append(f'the command {_RUNS["linear" if "linear" in self.hold else "zoh"]}')
        if self.leads:
            parts.append(
                f'the displacement {1e3 * self.lead:.3g} ms ahead of the recorded command (as '
                'behind a compensator, or with channels that were not read at once)'
            )
        alone = (
            f'Eq. (2) alone leaves {1e6 * self.error:.1f} um '
            f'instead of {1e6 * self.as_given:.1f} um'
        )
        if self.taken:
            return f'not as given but with {" and ".join(parts)}, where {alone}'
        return f'check the set-ups: with {" and ".join(parts)} {alone}'


def find(data: Data, given: Fit | None = None) -> WrongSetup | None:
    """Return a set-up that explains records far better than the one given; None for none.

    Args:
        data: the fitting part.
        given: Eq. (2) fitted to `stretched(data)`, where that is known.
    """
    some = stretched(data)
    given = given or base_fit(some)
    stroke = scale(some.records, given.theta).stroke
    left, noise = structure_and_noise(some, given.error)
    # Under a stationary command structure passes for noise: there, little of it says nothing.
    if left < least_material(noise, stroke) and not any(forecast.stationary(some)):
        return None
    others = list(_others(data))
    parts = [stretched(other) for other in others]
    ways = [(p, base_fit(p)) for p in parts]
    best = min(range(len(ways)), key=lambda i: ways[i][1].rms)
    ahead = some, _ahead(some, given)
    part, found = min(ways[best], ahead, key=lambda way: way[1].rms)
    noise = structure_and_noise(part, found.error)[1]
    material = least_material(noise, stroke)
    # A lead of half a sample is the other hold: what it is beyond that must matter.
    leads = _weight(ahead[1], material) > _weight(ways[best][1], material)
    part, found = ahead if leads else ways[best]
    if given.rms**2 - found.rms**2 < max(material**2, (SETUP_FAR - 1.0) * found.rms**2):
        return None
    if _nats(part, found, given) < NATS + math.log(len(ways) + 1):
        return None
    return WrongSetup.between(
        data,
        data if leads else others[best],
        (given.rms, found.rms),
        structure_and_noise(part, found.error)[0] < material,
        lead=float(found.theta[-1]) if leads else 0.0,
    )


def _weight(found: Fit, material: float) -> float:
    return log_weight(found.rms, MATTERING * material, len(found.theta))


def _ahead(data: Data, given: Fit) -> Fit:
    """Fit Eq. (2) with a displacement that runs ahead of its command."""
    effect = CATALOGUE[LEAD]
    starts = [(*given.theta, *sizes) for sizes in effect.starts(scale(data.records, given.theta))]
    return fit(data, Structure((effect,)), np.array(starts))


def stretched(data: Data) -> Data:
    """Return stretches that stand for long records; short ones as they are."""
    part = stretches(data)
    return part.data if part else data


def _nats(data: Data, better: Fit, given: Fit) -> float:
    scorer = Scorer.of(data, splits_of(data, better.error))
    return evidence(scorer.block_scores(better), scorer.block_scores(given))


def _others(data: Data) -> Iterator[Data]:
    """Yield the data with stiffnesses exchanged, with the other hold, and with both."""
    known = [r.known_stiffness() for r in data.records]
    values = sorted(set(known))
    orders = [
        [b if k == a else a if k == b else k for k in known] for a, b in combinations(values, 2)
    ]
    if len(known) <= _MOST:
        for i, j in combinations(range(len(known)), 2):
            order = list(known)
            order[i], order[j] = order[j], order[i]
            if order != known and order not in orders:
                orders.append(order)
    exchanged = [data.with_setup(stiffness=order) for order in orders]
    yield from exchanged
    linear = any(r.hold == 'linear' for r in data.recorded)
    for one in (*exchanged, data):
        yield one.with_setup(hold='zoh' if linear else 'linear')
