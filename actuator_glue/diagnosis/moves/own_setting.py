"""A channel set differently between tests: one record's own gain, bias, delay or clock.

What is set by hand between tests is no property of the machine, so one size for all records
cannot explain it. It is tried only where no effect of common size explains the records:
a setting in one stiffness alone looks like a specimen effect, and the specimen goes first.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from actuator_glue.diagnosis.moves.move import Asking
from actuator_glue.diagnosis.refits.refits import Refits
from actuator_glue.diagnosis.scopes.one_record import OneRecord
from actuator_glue.diagnosis.score.scorer import Scorer, evidence, pooled, splits_of
from actuator_glue.diagnosis.search.beam_search import BeamSearch
from actuator_glue.diagnosis.search.conclusion import Conclusion
from actuator_glue.diagnosis.search.table import Row, row
from actuator_glue.diagnosis.search.ties import compare
from actuator_glue.diagnosis.selection import Selection
from actuator_glue.diagnosis.trial import Trial, removed
from actuator_glue.inference.least_squares.fit import fit
from actuator_glue.model.structure import Structure
from actuator_glue.records import Record

SETTINGS = ('gain', 'bias', 'delay', 'clock-skew')


def own_setting(result: Conclusion, asking: Asking) -> Conclusion:
    """Return the answer with one record's own setting in it, where that explains the records.

    Beside Eq. (2) alone, else beside the effects found; else the same answer, with the rows of
    what was tried.
    """
    asking.tell('one record', 0.0)
    rows = list[Row]()
    for effects in sorted({(), result.found.final.effects}, key=len):
        beam = result.beam.apart()  # it takes the noise anew
        tried, found = _with_setting(result, beam, effects)
        rows += result.in_scope(tried)
        if found is None:
            continue
        other = replace(result.of(beam, found), others=tuple(rows))
        if other.outweighs(result):
            return other
    return replace(result, others=(*result.others, *rows))


def _with_setting(
    result: Conclusion, beam: BeamSearch, effects: tuple[str, ...]
) -> tuple[tuple[Row, ...], Selection | None]:
    """Refit a structure with every setting of one record's own.

    Args:
        result: the answer with effects of common size.
        beam: refits; its noise becomes that beside the best setting.
        effects: of the structure.

    Returns:
        A row of each, and the selection with the best one; None where that leaves more structure
        than a model may leave.
    """
    found, refits = result.found, beam.refits
    data, scorer = refits.data, refits.scorer
    if len(data.records) < 2:
        return (), None
    start, held = refits.trial(effects), result.prepared.held.records
    tried = [
        _fitted(refits, start, name, record, held)
        for name in SETTINGS
        if name not in effects
        for record in data.records
    ]
    tried.sort(key=lambda t: scorer.left_out_error(t.fit))  # their price is the same
    rows = tuple(_row(refits, t, start.structure, len(tried)) for t in tried)
    parts = splits_of(data, tried[0].fit.error)
    left, noise = pooled(data, parts)
    if left > result.decision.limit:
        return rows, None
    refits.scorer = replace(Scorer.of(data, parts), likely=left < found.material)
    tried, start = [refits.scorer.scored(t) for t in tried], refits.trial(effects)
    return rows, _attribution(beam, found, start, tried, (left, noise))


def _row(refits: Refits, trial: Trial, rest: Structure, tried: int) -> Row:
    """Return the row of a structure with one record's own setting, one of `tried`."""
    assert isinstance(trial.model, OneRecord)
    more = len(trial.model.parameters) - len(rest.parameters)
    cost = refits.price(rest) + more + float(np.log(tried))
    return row(trial.model, trial.effects, trial.fit, refits.scorer, cost, trial.model.scope)


def _fitted(
    refits: Refits,
    start: Trial,
    name: str,
    record: Record,
    held: tuple[Record, ...],
) -> Trial:
    structure = refits.structure(*start.effects, name)
    model = OneRecord(structure, name, (record,), (*refits.data.records, *held))
    thetas = refits.promises.screen(start, name)[1]
    found = fit(refits.data, model, thetas)
    return Trial(structure, name, found, refits.scorer.block_scores(found), model)


def _attribution(
    beam: BeamSearch,
    found: Selection,
    start: Trial,
    tried: Sequence[Trial],
    parts: tuple[float, float],
) -> Selection:
    """Return the selection with the best setting and its rivals."""
    refits, best = beam.refits, tried[0]
    nearest = {t.added: t for t in reversed(tried)}  # the record that each fits best
    others = [t for name, t in nearest.items() if name != best.added]
    odds = beam.odds(start, best, others)
    rivals = compare(start, best, others, odds, refits.scorer)
    gained = evidence(best.scores, start.scores)
    kept = {n: found.rivals[n] for n in start.effects}
    return replace(
        found,
        base=refits.trial(()),
        final=best,
        rivals=kept | {best.added: rivals},
        removed={n: found.removed[n] for n in start.effects} | {best.added: removed(start, best)},
        evidence={n: found.evidence[n] for n in start.effects} | {best.added: gained},
        left=parts[0],
        noise=parts[1],
    )
