"""The conclusion from the fitting part of the records, with everything it rests on."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

from actuator_glue.diagnosis.effort import Effort
from actuator_glue.diagnosis.measured import at_recorded_rate
from actuator_glue.diagnosis.measured.hum import Line
from actuator_glue.diagnosis.measured.measurement import Measured
from actuator_glue.diagnosis.refits.refits import Refits
from actuator_glue.diagnosis.samples.preparation import Prepared
from actuator_glue.diagnosis.scopes import change
from actuator_glue.diagnosis.scopes.one_record import OneRecord
from actuator_glue.diagnosis.scopes.onset import Appeared, Onset, dated
from actuator_glue.diagnosis.score import surrogate
from actuator_glue.diagnosis.score.scorer import Scorer
from actuator_glue.diagnosis.score.surrogate import Surrogate
from actuator_glue.diagnosis.search import force_ranking, table
from actuator_glue.diagnosis.search.beam_search import BeamSearch
from actuator_glue.diagnosis.search.fitting_verdict import Decision, decide
from actuator_glue.diagnosis.search.table import LINEAR, Row
from actuator_glue.diagnosis.selection import SearchStep, Selection
from actuator_glue.diagnosis.stages import Progress
from actuator_glue.diagnosis.thresholds import Thresholds
from actuator_glue.inference.least_squares.data import Data


@dataclass(frozen=True)
class Conclusion:
    """The conclusion from the fitting part of the records.

    Attributes:
        prepared: the records, fitting part and held-out part.
        line: hum that was removed from the data; None for none.
        found: effects with a mean response.
        seen: measurement effects.
        generic: a generic regression to compare them with.
        decision: the verdict.
        beam: the search that chose `found`, to continue from.
        history: the steps that led here.
        appeared: the onset, where this conclusion holds for the data since then only.
        others: rows of the searches that it replaced, or was compared with.
    """

    prepared: Prepared
    line: Line | None
    found: Selection
    seen: tuple[Measured, ...]
    generic: Surrogate
    decision: Decision
    beam: BeamSearch
    history: tuple[SearchStep, ...]
    appeared: Appeared | None = None
    others: tuple[Row, ...] = ()

    @property
    def data(self) -> Data:
        """The fitting part without hum."""
        return self.beam.refits.data

    @property
    def scorer(self) -> Scorer:
        """Noise and blocks of the final structure."""
        return self.beam.refits.scorer

    @property
    def scope(self) -> str:
        """Scope of the reported structure; empty for all records as they were given."""
        own = self.found.final.own
        scopes = (
            LINEAR if self.prepared.setup is not None else '',
            self.appeared.scope if self.appeared is not None else '',
            own.scope if isinstance(own, OneRecord) else '',
        )
        return ', '.join(filter(None, scopes))

    def rows(self) -> tuple[Row, ...]:
        """Return every structure that was refitted on the way here, without weights."""
        own = table.rows(self.beam.refits, self.scorer)
        return (*self.in_scope(own), *self.others)

    @cached_property
    def row(self) -> Row:
        """The row of the reported structure; hum counts as a part of its error."""
        key = self.scope, frozenset(self.found.final.effects)
        found = min((r for r in self.rows() if r.key == key), key=lambda r: r.left_out)
        line = self.line.rms if self.line is not None else 0.0
        return replace(found, left_out=math.hypot(found.left_out, line))

    def outweighs(self, other: Conclusion) -> bool:
        """Whether it has more weight than another answer about the same records.

        Where neither explains them, what remains may look like another scope: there, differences
        count in units of what remains.
        """
        both = self, other
        complete = any(answer.leaves_nothing for answer in both)
        units = [a.found.material if self.scope == other.scope else a.matters for a in both]
        return table.outweighs(self.row, other.row, min(units), complete)

    @property
    def leaves_nothing(self) -> bool:
        """Whether nothing that matters is left."""
        return self.decision.left < self.found.material

    @property
    def matters(self) -> float:
        """Rms error that tells scopes apart: what matters, or what remains unexplained [m]."""
        return max(self.found.material, self.decision.left)

    def in_scope(self, some: tuple[Row, ...]) -> tuple[Row, ...]:
        """Return rows of this answer's data as rows of all records as they were given."""
        some = self.over_all_data(some)
        linear = self.prepared.setup is not None
        return table.scoped(some, LINEAR, table.of_hold(self.beam.refits)) if linear else some

    def over_all_data(self, some: tuple[Row, ...]) -> tuple[Row, ...]:
        """Return rows of the data since the onset, if there is one, as rows of all data."""
        if self.appeared is None:
            return some
        before = self.appeared.before.fit
        cost = len(before.theta) + 1.0  # the earlier data's own parameters, and the onset's time
        some = table.since(some, before, self.data.target.size)
        return table.scoped(some, self.appeared.scope, cost)

    @property
    def effort(self) -> Effort:
        """Effort of the search: its cost so far, and its limit."""
        return self.beam.refits.effort

    @cached_property
    def onset(self) -> Onset | None:
        """When the effects appeared; None if they were there from the beginning."""
        if self.appeared is None:
            return None
        before, final = self.appeared.before, self.found.final
        found = dated(self.appeared, final, self.found.noise)
        if before.effects or final.effects or final.own is not None:
            return found
        one = change.alone(before, self.data, final.fit.rms, self.found.material)
        return replace(found, change=one)

    def of(self, beam: BeamSearch, found: Selection) -> Conclusion:
        """Return what another selection of effects says about the same records."""
        other = concluded(self.prepared, beam, found, self.line)
        return replace(other, appeared=self.appeared)


def concluded(
    prepared: Prepared, beam: BeamSearch, found: Selection, line: Line | None
) -> Conclusion:
    """Return the conclusion from a selection of effects, with effects of the measurement.

    Args:
        prepared: the records.
        beam: the search.
        found: its result.
        line: hum that was removed from the data before.
    """
    refits = beam.refits
    seen = at_recorded_rate.find(refits.data, found, line)
    chosen = found.final if found.final.effects else found.singles[0]
    generic = surrogate.compare(refits.data, refits.scorer, found.base, chosen)
    decision = decide(found, seen, generic)
    return Conclusion(prepared, line, found, seen, generic, decision, beam, found.steps)


def searched(
    prepared: Prepared,
    refits: Refits,
    line: Line | None,
    settings: Thresholds,
    tell: Progress,
    earlier: Conclusion | None = None,
) -> Conclusion:
    """Search for what the model lacks, one effect at a time; return the conclusion.

    Args:
        prepared: the records.
        refits: refits structures to the fitting part.
        line: hum that was removed from the data before.
        settings: what a caller may set.
        tell: takes progress.
        earlier: conclusion from the same samples, cleaned differently, to continue from.
    """
    beam = BeamSearch(refits, settings, tell)
    if earlier is None or not earlier.found.final.effects:
        named = beam.run()
    else:
        named = beam.resumed(earlier.beam.refits, earlier.found)
        named = replace(named, steps=(*earlier.history, *named.steps))
    if settings.use_force:
        before = named.final
        named, told = force_ranking.decided(refits, named)
        if named.final.effects != before.effects:
            step = SearchStep.to(named.final, 'the name that the force tells')
            named = replace(named, steps=(*named.steps, step))
        prepared = replace(prepared, notes=(*told, *prepared.notes))
    return concluded(prepared, beam, named, line)
