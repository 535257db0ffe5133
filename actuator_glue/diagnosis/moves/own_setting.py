"""A channel set differently between tests: one record's own gain, bias, delay or clock.

What is set by hand between tests is no property of the machine, so one size for all records
cannot explain it. It is tried only where no effect of common size explains the records:
a setting in one stiffness alone looks like a specimen effect, and the specimen goes first.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from actuator_glue.diagnosis.moves.move import Asking
from actuator_glue.diagnosis.refits.structures import Search
from actuator_glue.diagnosis.scopes.one_record import OneRecord
from actuator_glue.diagnosis.score.scorer import Scorer, evidence, pooled, splits_of
from actuator_glue.diagnosis.score.weights import price
from actuator_glue.diagnosis.search.beam_search import BeamSearch
from actuator_glue.diagnosis.search.conclusion import Conclusion
from actuator_glue.diagnosis.search.gains import removed
from actuator_glue.diagnosis.search.table import Row, row
from actuator_glue.diagnosis.search.ties import compare
from actuator_glue.diagnosis.selection import Selection
from actuator_glue.diagnosis.trial import Trial
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.inference.least_squares.fit import fit
from actuator_glue.model.structure import Structure
from actuator_glue.records import Record

SETTINGS = ('gain', 'bias', 'delay', 'clock-skew')


def own_setting(result: Conclusion, asking: Asking) -> Conclusion:
    """Return the answer with one record's own setting in it, where that explains the records.

    Else the same answer, with the rows of what was tried.
    """
    asking.tell('one record', 0.0)
    rows = list[Row]()
    for found, tried in settings(result):
        rows += result.in_scope(tried)
        if found is None:
            continue
        other = replace(result.of(result.selection, found), others=tuple(rows))
        if other.outweighs(result):
            return other
    return replace(result, others=(*result.others, *rows))


def _members(data: Data, held: Sequence[Record], index: int) -> tuple[Record, ...]:
    """The record and the held-out tests of its set-up.

    All tests under its stiffness if no other record has that, else those of its own command.
    """
    own = data.records[index]
    stiffness = own.known_stiffness()
    if sum(r.known_stiffness() == stiffness for r in data.records) > 1:
        return (own, *(r for r in held if np.array_equal(r.command, own.command)))
    return (own, *(r for r in held if r.known_stiffness() == stiffness))


def settings(result: Conclusion) -> Iterator[tuple[Selection | None, tuple[Row, ...]]]:
    """Yield selections with one record's own setting.

    First beside Eq. (2) alone, then beside the effects found. With each come rows of all settings
    tried. It is None where the best of them leaves more structure than a model may leave.

    Args:
        result: the answer with effects of common size.
    """
    selection, found = result.selection, result.found
    search, data = selection.search, selection.search.data
    if len(data.records) < 2 or search.scorer is None:
        return
    held = result.prepared.held.records
    for effects in sorted({(), found.final.effects}, key=len):
        start = search.trial(effects)
        tried = [
            _fitted(search, start, name, _members(data, held, i))
            for name in SETTINGS
            if name not in effects
            for i in range(len(data.records))
        ]
        scored = search.scorer
        tried.sort(key=lambda t: scored.left_out_error(t.fit))  # their price is the same
        rows = tuple(_row(search, t, start.structure, len(tried)) for t in tried)
        parts = splits_of(data, tried[0].fit.error)
        left, noise = pooled(data, parts)
        if left > result.decision.limit:
            yield None, rows
            continue
        search.scorer = replace(Scorer.of(data, parts), likely=left < found.material)
        tried, start = [_rescored(search, t) for t in tried], search.trial(effects)
        yield _attribution(selection, found, start, tried, (left, noise)), rows
        search.scorer = scored  # the setting was not taken


def _row(search: Search, trial: Trial, rest: Structure, tried: int) -> Row:
    """Return the row of a structure with one record's own setting, one of `tried`."""
    assert search.scorer is not None and isinstance(trial.model, OneRecord)
    more = len(trial.model.parameters) - len(rest.parameters)
    cost = price(rest, search.entries, len(search.names)) + more + float(np.log(tried))
    return row(trial.model, trial.effects, trial.fit, search.scorer, cost, trial.model.scope)


def _fitted(search: Search, start: Trial, name: str, records: tuple[Record, ...]) -> Trial:
    structure = search.structure(*start.effects, name)
    model = OneRecord(structure, name, records)
    thetas = search.screen(start, name)[1]
    found = fit(search.data, model, thetas)
    assert search.scorer is not None
    return Trial(structure, name, found, search.scorer.block_scores(found), model)


def _rescored(search: Search, trial: Trial) -> Trial:
    assert search.scorer is not None
    return replace(trial, scores=search.scorer.block_scores(trial.fit))


def _attribution(
    selection: BeamSearch,
    found: Selection,
    start: Trial,
    tried: Sequence[Trial],
    parts: tuple[float, float],
) -> Selection:
    """Return the selection with the best setting and its rivals."""
    search, best = selection.search, tried[0]
    assert search.scorer is not None
    nearest = {t.added: t for t in reversed(tried)}  # the record that each fits best
    others = [t for name, t in nearest.items() if name != best.added]
    odds = selection.odds(start, best, others)
    rivals = compare(start, best, others, odds, search.scorer, selection.settings)
    gained = evidence(best.scores, start.scores)
    kept = {n: found.rivals[n] for n in start.effects}
    return replace(
        found,
        base=search.trial(()),
        final=best,
        rivals=kept | {best.added: rivals},
        removed={n: found.removed[n] for n in start.effects} | {best.added: removed(start, best)},
        evidence={n: found.evidence[n] for n in start.effects} | {best.added: gained},
        left=parts[0],
        noise=parts[1],
    )
