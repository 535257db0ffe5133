"""A channel set differently between tests: one record's own gain, bias, delay or clock.

What is set by hand between tests is no property of the machine, so one size for all records
cannot explain it. It is tried only where no effect of common size explains the records:
a setting in one stiffness alone looks like a specimen effect, and the specimen goes first.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from actuator_glue.diagnosis.beam_search import BeamSearch
from actuator_glue.diagnosis.conclusion import Conclusion
from actuator_glue.diagnosis.moves.move import Asking
from actuator_glue.diagnosis.one_record import OneRecord
from actuator_glue.diagnosis.ranking import removed
from actuator_glue.diagnosis.score import Scorer, evidence, pooled, splits_of
from actuator_glue.diagnosis.search import Search
from actuator_glue.diagnosis.selection import Selection
from actuator_glue.diagnosis.table import Row, row
from actuator_glue.diagnosis.ties import compare
from actuator_glue.diagnosis.trial import Trial
from actuator_glue.diagnosis.weights import price
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.inference.least_squares.fit import fit
from actuator_glue.model.effects import CATALOGUE
from actuator_glue.model.structure import Structure
from actuator_glue.records import Record

SETTINGS = ('gain', 'bias', 'delay', 'clock-skew')


def own_setting(result: Conclusion, asking: Asking) -> Conclusion:
    """Return the answer with one record's own setting in it, where that explains the records.

    Else the same answer, with the rows of what was tried.
    """
    asking.tell('one record', 0.0)
    limit, held = result.decision.limit, result.prepared.held.records
    found, rows = setting(result.selection, result.found, limit, held)
    rows = result.in_scope(rows)
    if found is None:
        return replace(result, others=(*result.others, *rows))
    return replace(result.of(result.selection, found), others=rows)


def _members(data: Data, held: Sequence[Record], index: int) -> tuple[Record, ...]:
    """The record and the held-out tests of its set-up.

    Those under its stiffness if no other record has it, else its own held-out blocks.
    """
    own = data.records[index]
    stiffness = own.known_stiffness()
    if sum(r.known_stiffness() == stiffness for r in data.records) > 1:
        return (own, *(r for r in held if np.array_equal(r.command, own.command)))
    return (own, *(r for r in held if r.known_stiffness() == stiffness))


def setting(
    selection: BeamSearch, found: Selection, limit: float, held: Sequence[Record]
) -> tuple[Selection | None, tuple[Row, ...]]:
    """Ask whether one record's own setting explains what common sizes do not.

    The setting must leave at most `limit` of structure, remove a material error and gain the
    evidence of any addition, less a nat per parameter and the logarithm of how many were tried.

    Args:
        selection: the search that ended with `found`; its noise is taken anew from the answer.
        found: its result with effects of common size.
        limit: structure above which records count as unexplained [m].
        held: held-out records, which share a setting through their stiffness.

    Returns:
        The attribution with the setting added, or None; and a row for each that was tried.
    """
    search, settings = selection.search, selection.settings
    data, rows = search.data, list[Row]()
    if len(data.records) < 2 or search.scorer is None:
        return None, ()
    for effects in sorted({(), found.final.effects}, key=len):
        start = search.trial(effects)
        names = [n for n in SETTINGS if n not in effects]
        tried = [
            _fitted(search, start, name, _members(data, held, i))
            for name in names
            for i in range(len(data.records))
        ]
        rows += [_row(search, t, start.structure, len(tried)) for t in tried]
        tried.sort(key=lambda t: -float(t.scores.sum()))
        best = tried[0]
        parts = splits_of(data, best.fit.error)
        left, noise = pooled(data, parts)
        if left > limit or removed(start, best) < found.material:
            continue
        search.scorer = replace(Scorer.of(data, parts), likely=left < found.material)
        tried, start = [_rescored(search, t) for t in tried], search.trial(effects)
        common = search.trial(found.final.effects)
        cost = len(best.fit.theta) - len(start.fit.theta) + float(np.log(len(tried)))
        gained = evidence(tried[0].scores, common.scores) - cost
        if gained < settings.nats:
            continue
        return _attribution(selection, found, start, tried, (left, noise)), tuple(rows)
    return None, tuple(rows)


def _row(search: Search, trial: Trial, rest: Structure, tried: int) -> Row:
    """Return the row of a structure with one record's own setting, one of `tried`."""
    assert search.scorer is not None and isinstance(trial.model, OneRecord)
    more = len(trial.model.parameters) - len(rest.parameters)
    cost = price(rest, search.entries, len(search.names)) + more + float(np.log(tried))
    return row(trial.model, trial.effects, trial.fit, search.scorer, cost, trial.model.scope)


def _fitted(search: Search, start: Trial, name: str, records: tuple[Record, ...]) -> Trial:
    effects = tuple(n for n in CATALOGUE if n in start.effects or n == name)
    model = OneRecord(effects, name, records)
    thetas = search.screen(start, name)[1]
    found = fit(search.data, model, thetas)
    assert search.scorer is not None
    return Trial(Structure(effects), name, found, search.scorer.block_scores(found), model)


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
