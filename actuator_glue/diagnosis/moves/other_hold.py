"""How the command ran between its samples: held, as is assumed, or linearly."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from actuator_glue.diagnosis.learned.term import any_learned
from actuator_glue.diagnosis.measured import hum
from actuator_glue.diagnosis.moves.learned_terms import LEARNED_TERMS
from actuator_glue.diagnosis.moves.move import Asking, follow
from actuator_glue.diagnosis.refits.refits import Refits
from actuator_glue.diagnosis.samples.preparation import Prepared
from actuator_glue.diagnosis.scopes.hold_and_stiffness import WrongSetup
from actuator_glue.diagnosis.search import table
from actuator_glue.diagnosis.search.conclusion import Conclusion
from actuator_glue.inference.least_squares.fit import Fit, fit

_SINGLES = 3  # best single effects that are refitted with the other hold


def other_hold(first: Conclusion, asking: Asking) -> Conclusion | None:
    """Search with the other hold, where that may have more weight.

    The wrong hold is a lead of half a sample: no effect of the catalogue, but something will be
    found for it (a gain that drifts, say). Held commands taken for linear ones are a delay, which
    is in the catalogue. Where the catalogue explains the records with neither hold, terms are
    learned with both: an effect outside it may look like the other hold.

    The search is made where Eq. (2) alone, the structure found or one of the best single effects
    has more weight with it than the answer; while something is missing, also where Eq. (2) alone
    leaves materially less.
    """
    prepared, linear = first.prepared, first.prepared.setup is not None
    held_commands = any(r.hold == 'zoh' for r in prepared.fit.recorded)
    # Where nothing is missing with a hold that was not given, an effect may explain more with the
    # one that was.
    if not (linear or (held_commands and first.decision.verdict != 'none')):
        return None
    other = prepared.with_hold('zoh' if linear else 'linear', None)
    base = Refits(other.fit, ()).base()
    before = first.found.base.mean_square + (first.line.rms**2 if first.line else 0.0)
    if not _may_outweigh(first, other, base):
        named = not any_learned(first.found.final.structure)
        complete = first.decision.verdict == 'missing-effect' and named
        if complete or before - base.rms**2 < first.found.material**2:
            return None
    asking.tell('other hold', 0.0)
    second = follow(asking.conclude(other), LEARNED_TERMS, asking)
    if not linear:
        errors, enough = (before**0.5, base.rms), second.decision.verdict == 'none'
        setup = WrongSetup.between(prepared.fit, other.fit, errors, enough, taken=True)
        second = replace(second, prepared=replace(second.prepared, setup=setup))
    return replace(second, others=second.in_scope(second.others))


def _may_outweigh(first: Conclusion, other: Prepared, base: Fit) -> bool:
    """Whether one of the best structures so far has more weight with the other hold."""
    found, refits = first.found, first.beam.refits
    data = other.fit if first.line is None else hum.without(other.fit, first.line)
    line = 0.0 if first.line is None else first.line.rms
    complete = first.decision.verdict != 'unexplained'
    for trial in (found.base, found.final, *found.singles[:_SINGLES]):
        if trial.own is not None:
            continue
        starts = np.stack([trial.fit.theta, trial.fit.theta])
        starts[1, : len(base.theta)] = base.theta
        again = first.effort.spent_on(fit(data, trial.structure, starts))
        cost = refits.price(trial.structure)
        row = table.row(trial.structure, trial.effects, again, first.scorer, cost)
        row = replace(row, left_out=math.hypot(row.left_out, line))
        if first.prepared.setup is None:
            (row,) = table.scoped([row], table.LINEAR, table.of_hold(refits))
        if table.outweighs(row, first.row, found.material, complete):
            return True
    return False
