"""From prepared records to a verdict: search, measurement effects, surrogate, decision."""

from __future__ import annotations

import math
from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, fields, replace
from functools import cached_property

from actuator_glue.diagnosis import (
    chance,
    cleaned,
    companions,
    exchange,
    force_ranking,
    learning,
    per_record_settings,
    recorded,
    regression,
    together,
    transducer,
)
from actuator_glue.diagnosis.candidates import mean_effects
from actuator_glue.diagnosis.completeness import Decision, decide
from actuator_glue.diagnosis.effort import Effort
from actuator_glue.diagnosis.measured import hum
from actuator_glue.diagnosis.measured.hum import Line
from actuator_glue.diagnosis.measured.measurement import Measured
from actuator_glue.diagnosis.model_selection import ModelSelection
from actuator_glue.diagnosis.onset.onset import Appeared, Onset, dated
from actuator_glue.diagnosis.preparation import Prepared
from actuator_glue.diagnosis.regression import Surrogate
from actuator_glue.diagnosis.score import Scorer
from actuator_glue.diagnosis.search import Search
from actuator_glue.diagnosis.selection import Selection
from actuator_glue.diagnosis.stages import Progress
from actuator_glue.diagnosis.thresholds import Thresholds
from actuator_glue.diagnosis.trial import Trial
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.inference.least_squares.each import Each
from actuator_glue.inference.least_squares.fit import fit


@dataclass(frozen=True)
class Conclusion:
    """What the fitting part of the records says.

    Attributes:
        prepared: the records, fitting part and held-out part.
        data: the fitting part without hum.
        scorer: noise and blocks of the final structure.
        line: hum.
        found: effects with a mean response.
        seen: measurement effects.
        generic: the regression beside them.
        decision: the verdict.
        selection: what chose `found`, to go on from.
        appeared: where all this is about the data since something appeared, what is known of that.
    """

    prepared: Prepared
    data: Data
    scorer: Scorer
    line: Line | None
    found: Selection
    seen: tuple[Measured, ...]
    generic: Surrogate
    decision: Decision
    selection: ModelSelection
    appeared: Appeared | None = None

    @property
    def effort(self) -> Effort:
        """What the search cost so far."""
        return self.selection.search.effort

    @cached_property
    def onset(self) -> Onset | None:
        """When the effects appeared that are found now; None for from the beginning."""
        if self.appeared is None:
            return None
        return dated(self.appeared, self.decision.final, self.decision.noise)


def conclude(
    prepared: Prepared,
    settings: Thresholds,
    each: Each,
    tell: Progress,
    effort: Effort,
    fixed: bool = False,
) -> Conclusion:
    """Search for what the model lacks and decide; nothing looks at the held-out part.

    What friction leaves to chance does not count, unless the samples that count are fixed. Where
    impulses that could have swayed it show beside what was found, or what was taken for some shows
    to be none, they are taken out, or restored, and all is done again.
    """
    tell('base fit', 0.0)
    prepared, search, line = _begun(prepared, settings, each, effort, fixed)
    first = _conclude(prepared, search, line, settings, tell)
    final = first.found.final
    clean = cleaned.without_impulses(prepared, final)
    if clean is prepared:
        return first
    taken = prepared.fit.target - clean.fit.target
    if not cleaned.swayed(final.fit, first.scorer, taken):
        return first
    return _conclude(*_begun(clean, settings, each, effort, fixed=True), settings, tell)


def as_given(
    prepared: Prepared, settings: Thresholds, each: Each, tell: Progress, effort: Effort
) -> Conclusion:
    """Say what Eq. (2) leaves, and each effect beside it, without any search."""
    tell('base fit', 0.0)
    prepared, search, line = _begun(prepared, settings, each, effort, fixed=True)
    return _searched(prepared, search, line, replace(settings, most=0), tell)


def _begun(
    prepared: Prepared, settings: Thresholds, each: Each, effort: Effort, fixed: bool
) -> tuple[Prepared, Search, Line | None]:
    search = Search(prepared.fit, mean_effects(), each, effort=effort)
    line = hum.find(prepared.fit, search.base().error)
    if line is not None:
        data = hum.without(prepared.fit, line)
        search = Search(data, mean_effects(), each, effort=effort)
    return *chance.without(prepared, search, settings, fixed), line


def _conclude(
    prepared: Prepared, search: Search, line: Line | None, settings: Thresholds, tell: Progress
) -> Conclusion:
    result = _searched(prepared, search, line, settings, tell)
    if line is not None and result.found.final.effects:
        left = _line_left(prepared.fit, result.found.final)
        if left is None or not left.same_as(line):
            data = prepared.fit if left is None else hum.without(prepared.fit, left)
            search = Search(data, search.names, search.each, effort=search.effort)
            result = _searched(prepared, search, left, settings, tell)
    fed_back = transducer.in_the_loop(result.selection, result.found)
    if fed_back is not None:
        described = _described(result, fed_back)
        if described is not None:
            return described
        result = _conclusion(prepared, result.selection, fed_back, result.line)
    elif result.decision.verdict == 'missing-effect':
        selection = _apart(result.selection)  # forms and their signatures serve all ways
        for way in learning.ways(result.found):
            if result.effort.over:
                break
            if other := _complete(result, selection, way(selection, result.found)):
                return other
    if _goes_on(result) and mean_effects(reserved=True):
        result = _with_reserved(prepared, result, settings, tell)
    if not _goes_on(result):
        return result
    prepared, selection, search = result.prepared, result.selection, result.selection.search
    tell('one record', 0.0)
    limit = result.decision.limit
    found, held = result.found, prepared.held.records
    own = per_record_settings.setting(search, found, limit, held, settings)
    return result if own is None else _conclusion(prepared, selection, own, result.line)


def _goes_on(result: Conclusion) -> bool:
    """Whether something is left to be explained, and effort to do it."""
    return result.decision.verdict == 'unexplained' and not result.effort.over


def _described(result: Conclusion, fed_back: Selection) -> Conclusion | None:
    """Describe by learned terms what a fault in the loop explains, where that is better."""
    if fed_back.left >= result.selection.material:
        return None
    selection = _apart(result.selection)
    found = learning.learned(selection, result.found)
    if found is None or not learning.as_good_and_plainer(selection, found, fed_back):
        return None
    return _complete(result, selection, found)


def _complete(
    result: Conclusion, selection: ModelSelection, found: Selection | None
) -> Conclusion | None:
    """Return another answer about the same records, if there is one and it is complete."""
    if found is None:
        return None
    other = _conclusion(result.prepared, selection, found, result.line)
    if other.decision.verdict == 'unexplained':
        return None
    return replace(other, appeared=result.appeared)


def _apart(selection: ModelSelection) -> ModelSelection:
    """Return a selection to learn terms with: what it adds and its noise are its own."""
    other, search = copy(selection), _wider(selection.search, ())
    other.search = replace(search, entries=dict(search.entries))
    return other


def _line_left(data: Data, final: Trial) -> Line | None:
    """Return the hum in the final residual: in Eq. (2)'s it may be an effect's response."""
    return hum.find(data, fit(data, final.model, final.fit.theta).error)


def _searched(
    prepared: Prepared, search: Search, line: Line | None, settings: Thresholds, tell: Progress
) -> Conclusion:
    selection = ModelSelection(search, settings, tell)
    named = selection.run()
    if settings.use_force:
        named, told = force_ranking.decided(search, named, settings)
        prepared = replace(prepared, notes=(*told, *prepared.notes))
    return _conclusion(prepared, selection, named, line)


def _with_reserved(
    prepared: Prepared, first: Conclusion, settings: Thresholds, tell: Progress
) -> Conclusion:
    """Search again with the effects that are reserved for what all others leave.

    Where one of them alone, or beside what was found, is better beyond chance and by a material
    error; and so must be the answer, with one of them in it or complete without: it may lead to
    what the first search did not reach. A mode that rings on passes for hum: with it, hum is
    asked for once more.
    """
    reserved, before = mean_effects(reserved=True), first.found.final
    usual, cost = first.selection.search, math.log(len(reserved))
    ways = [(_wider(usual, reserved), first.line)]
    if first.line is not None:
        names = *usual.names, *reserved
        whole = Search(prepared.fit, names, usual.each, effort=usual.effort)
        ways.insert(0, (whole, None))

    def better(after: Trial, scorer: Scorer) -> bool:
        known = replace(before, scores=scorer.block_scores(before.fit))
        return first.selection.better(after, known, first.found.material, cost)

    for search, line in ways:
        search.scorer = first.scorer
        search.base()
        starts = [
            search.trial(t.effects) for t in (first.found.base, before) if search.known(t.effects)
        ]
        if not any(better(t, first.scorer) for s in starts for t in search.additions(s, reserved)):
            continue
        second = _searched(prepared, search, line, settings, tell)
        found = second.found.final
        told = set(found.effects) & set(reserved) or second.decision.verdict != 'unexplained'
        if told and better(found, second.scorer):
            return second
    return first


def _wider(search: Search, names: Sequence[str]) -> Search:
    """Return a search that tries further effects; what was refitted is known to it."""
    own = {f.name: copy(getattr(search, f.name)) for f in fields(search) if f.name[0] == '_'}
    return replace(search, names=(*search.names, *names), **own)


def with_learned_terms(result: Conclusion) -> Conclusion:
    """Describe by learned terms material structure that the catalogue leaves, or names badly.

    Another shape of a cause that was named comes before further terms. Where no term is worth it
    either, two effects may hide each other.
    """
    decision, found = result.decision, result.found
    left = decision.verdict == 'unexplained' or decision.left >= found.material
    if result.effort.over or not left or found.final.own is not None:
        return result
    described = learning.reshaped(result.selection, found)
    if described is None or described.left >= described.material:
        described = learning.learned(result.selection, described or found) or described
    if described is not None:
        learned = _conclusion(result.prepared, result.selection, described, result.line)
        return replace(learned, appeared=result.appeared)
    if decision.verdict != 'unexplained':
        return result
    selection = _apart(result.selection)
    return _complete(result, selection, together.explained(selection, found)) or result


def with_what_matters(result: Conclusion) -> Conclusion:
    """Look for effects that passed for noise beside an answer that seems complete.

    What removes as much as an addition must is added; two names take the place of one where that
    says surely more.
    """
    for ask in (companions.that_matter, exchange.exchanged):
        if result.effort.over or result.decision.verdict != 'missing-effect':
            return result
        found = ask(result.selection, result.found)
        result = _complete(result, result.selection, found) or result
    return result


def _conclusion(
    prepared: Prepared, selection: ModelSelection, found: Selection, line: Line | None
) -> Conclusion:
    search, settings = selection.search, selection.settings
    assert search.scorer is not None
    data = search.data
    seen = recorded.find(data, found, settings, line)
    chosen = found.final if found.final.effects else found.singles[0]
    generic = regression.compare(data, search.scorer, found.base, chosen)
    decision = decide(found, seen, data, settings, generic)
    return Conclusion(
        prepared, data, search.scorer, line, found, seen, generic, decision, selection
    )
