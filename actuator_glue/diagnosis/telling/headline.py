"""The one line of a diagnosis, from the numbers that its notes, JSON and exit code have."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Protocol

from actuator_glue.diagnosis.finding import Finding
from actuator_glue.diagnosis.learned.term import LearnedTerm
from actuator_glue.diagnosis.scopes.hold_and_stiffness import WrongSetup
from actuator_glue.diagnosis.scopes.onset import Onset
from actuator_glue.diagnosis.thresholds import LIKELY
from actuator_glue.diagnosis.verdict.alarm import Alarm
from actuator_glue.diagnosis.verdict.held_out import HeldOutError
from actuator_glue.diagnosis.verdict.rules import Excuse, excuse, likely, misses
from actuator_glue.diagnosis.verdict.traces import Trace
from actuator_glue.diagnosis.verdicts import Verdict
from actuator_glue.json_value import Json
from actuator_glue.records import source_names


class Told(Protocol):
    """What the line is made of; the attributes are those of `DiagnosisData`."""

    @property
    def verdict(self) -> Verdict:
        """The verdict."""

    @property
    def effects(self) -> Sequence[Finding]:
        """Additions that are supported."""

    @property
    def learned(self) -> Sequence[LearnedTerm]:
        """Learned terms among these."""

    @property
    def error(self) -> HeldOutError:
        """Held-out error before and after."""

    @property
    def alarm(self) -> Alarm:
        """Why Eq. (2) is not enough, or is."""

    @property
    def remaining(self) -> Json:
        """Where the unexplained residual lies."""

    @property
    def traces(self) -> Sequence[Trace]:
        """Curves of each record, fitted or held out."""

    @property
    def onset(self) -> Onset | None:
        """When the effects appeared; None if they were there from the beginning."""

    @property
    def setup(self) -> WrongSetup | None:
        """Another set-up that explains the records far better; None for none."""

    @property
    def doubts(self) -> Sequence[str]:
        """Why the answer must not be used as it stands."""


def record_names(traces: Sequence[Trace], others: Iterable[str]) -> dict[str, str]:
    """Return what people read as the names of records, from their curves and other sources.

    A diagnosis has one set of them, for its sentences, tables and pictures: a record that is held
    out is told from those that were fitted, too.
    """
    return source_names([*(t.source for t in traces), *others])


def names_of(found: Told) -> dict[str, str]:
    """Return what people read as the name of each record that a diagnosis was asked about."""
    others = [source for source, _, _ in found.error.records]
    others += [row['source'] for row in found.remaining.get('records', ())]
    others += [source for effect in found.effects for source in effect.records]
    if found.onset is not None:
        others.append(found.onset.source)
    return record_names(found.traces, others)


def _named(effect: Finding, found: Told) -> str:
    equations = [term.numbers for term in found.learned if term.name == effect.name]
    if equations:
        term = f'a learned term {effect.name} ({equations[0]})'
        return f'{effect.cause} in another shape, {term}' if effect.cause else term
    where = ''
    if effect.records:
        name = names_of(found)
        where = f' in {", ".join(name[r] for r in effect.records)} only'
    if not likely(effect):
        return (
            f'something that looks most like {effect.name} ({_share(effect.probability)}){where}'
        )
    if effect.probability < LIKELY:
        shares = {r.name: r.probability for r in effect.rivals}
        tied = (effect.name, *effect.alternatives)
        return f'one of {", ".join(f"{n} ({_share(shares[n])})" for n in tied)}{where}'
    others = f' (or {", ".join(effect.alternatives)})' if effect.alternatives else ''
    return effect.name + where + others


def _share(probability: float) -> str:
    return f'{100 * probability:.2g} %'


def _noise(found: Told) -> str:
    """State the noise, by itself or relative to the error, and its known causes."""
    floor = found.error.noise_floor
    parts = [f'{1e6 * (e.noise or 0.0):.1f} um by {e.name}' for e in found.effects if e.noise]
    text = f'noise {1e6 * floor:.1f} um'
    if misses(found.error, found.alarm.threshold):
        times = found.error.after / floor if floor > 0.0 else math.inf
        text = f'{times:.1f} times the noise of {1e6 * floor:.1f} um'
    return f'{text} ({", ".join(parts)})' if parts else text


def _errors(found: Told, named: bool) -> str:
    """State the held-out error; where there are two, first the one behind the verdict."""
    error = found.error

    def change(before: float | None, after: float) -> str:
        start = f'{1e6 * before:.1f} -> ' if named and before is not None else ''
        return f'{start}{1e6 * after:.1f} um'

    best = change(error.before, error.after)
    other = excuse(error, found.alarm.threshold)
    if other is None:
        return best
    return f'{change(other.before, other.after)} {other.how} ({best} {other.otherwise})'


def left_open(found: Told) -> Excuse | None:
    """Return what explains held-out records of which the fitting ones leave too much open.

    None where an answer is incomplete for another reason: the fitting records themselves show more
    than it holds, or ask for what the held-out ones do not, or a name is improbable.
    """
    if found.verdict == 'undecided':
        open_ = all(e.noise is not None for e in found.effects)
    elif found.verdict == 'unexplained':
        explained = found.remaining['left'] <= found.remaining['limit']
        open_ = explained and all(map(likely, found.effects))
    else:
        open_ = False
    return excuse(found.error, found.alarm.threshold) if open_ else None


def headline(found: Told) -> str:
    """Return the verdict in one line, never more than the held-out part confirms.

    Doubts, and a wrong set-up, are reported first.
    """
    parts = [_verdict(found)]
    if found.setup is not None:
        parts.insert(0, found.setup.sentence())
    if found.doubts:
        parts.insert(0, f'not to be used as it stands: {"; ".join(found.doubts)}')
    return '; '.join(parts)


def _verdict(found: Told) -> str:
    names = ', '.join(_named(e, found) for e in found.effects if e.noise is None)
    enough, asked = 'the model is enough', names
    if found.onset is not None:
        source = found.onset.source
        when = f' since {found.onset.time:.1f} s of {names_of(found)[source]}'
        one = found.onset.change
        changed = 'its parameters changed' + (f', {one.sentence()}' if one is not None else '')
        names += when if names else ''
        asked = names or f'a change{when}, where {changed}'
        enough += f'{when}, where {changed}'
    change = f'held-out error {_errors(found, bool(names))}, {_noise(found)}'
    if found.verdict == 'undecided':
        asked = f'for {asked}, the held-out part does not' if asked else 'for nothing'
        return f'undecided: the fitting records ask {asked}; {change}'
    if found.verdict == 'unexplained':
        left = f'{1e6 * found.remaining["left"]:.1f}'
        if float(left) > 0.0:  # else it is the held-out part alone that shows more
            change += f'; {left} um of structure in the fitting records remain'
        if not names:
            return f'the model is not enough and no addition is supported: {change}'
        if left_open(found) is not None:
            return f'added, and left open by the fitting records: {names}; {change}'
        return f'added, but not the whole story: {names}; {change}'
    return f'missing: {names}; {change}' if names else f'{enough}: {change}'
