"""Decide whether Eq. (2) is enough for given records and, if not, which effect it lacks."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from actuator_glue.diagnosis.effort import Effort
from actuator_glue.diagnosis.pipeline import as_given, conclude
from actuator_glue.diagnosis.posterior.answer_posterior import sampled
from actuator_glue.diagnosis.remembered import Before, Remembered
from actuator_glue.diagnosis.samples.force import check_forces
from actuator_glue.diagnosis.samples.preparation import prepare
from actuator_glue.diagnosis.scopes import hold_and_stiffness
from actuator_glue.diagnosis.stages import Progress, ShareDone, Stage
from actuator_glue.diagnosis.telling.result import DiagnosisData
from actuator_glue.diagnosis.telling.telling import told
from actuator_glue.diagnosis.thresholds import Thresholds
from actuator_glue.diagnosis.verdict import both_parts
from actuator_glue.diagnosis.verdict.first_look import FirstLook
from actuator_glue.inference.least_squares.base_prior import BasePrior
from actuator_glue.inference.least_squares.each import Each
from actuator_glue.inference.least_squares.fit import base_fit
from actuator_glue.inference.least_squares.space import UPPER
from actuator_glue.records import Record


def diagnose(
    records: Sequence[Record],
    holdout: Sequence[Record] | Record | None = None,
    *,
    seed: int = 0,
    each: Each = map,
    progress: Progress | None = None,
    first_look: Callable[[FirstLook], None] | None = None,
    settings: Thresholds | None = None,
    before: Before | None = None,
) -> DiagnosisData:
    """Diagnose records whose specimen stiffness is known.

    Args:
        records: fitting records of one actuator.
        holdout: record(s) that decide nothing and give the error before and after; without
            one, a quarter of each record is set aside in blocks before any look.
        seed: seed of every random step; the same seed gives the same diagnosis.
        each: refits candidates and evaluates draws: `map`, or that of a pool of threads.
        progress: called with (stage, share of the whole that is done, in [0, 1]).
        first_look: called once, seconds after the start, with what Eq. (2) leaves.
        settings: what a caller may set; usual ones if not given.
        before: what was known of the machine before.

    Raises:
        InputError: stiffness not known, records too short, or nothing moves.
    """
    settings, before = settings or Thresholds(), before or Before()
    prior = before.prior
    remembered = before.remembered or Remembered()

    def tell(stage: Stage, share: float) -> None:
        if progress is not None:
            progress(stage, done(stage, share))

    effort = Effort(settings.effort, remembered.copied(), remembered, tell=lambda: tell(*done.now))
    done = ShareDone(effort)
    held = [holdout] if isinstance(holdout, Record) else list(holdout or ())
    tell('check', 0.0)
    known = None if prior is None else BasePrior(prior.carried, UPPER)
    if settings.use_force:
        check_forces(records)
    ready = prepare(records, held, known)
    some = hold_and_stiffness.stretched(ready.fit)
    given = base_fit(some)
    look = FirstLook.of(some, given)
    if first_look is not None:
        first_look(look)
    other = hold_and_stiffness.find(ready.fit, given)
    if other is not None and other.runs_linearly:
        # The search starts with the likelier hold and decides between both at its end.
        ready, other = ready.with_hold('linear', replace(other, taken=True)), None
    elif other is not None and other.leads:
        ready, other = replace(ready, also=(hold_and_stiffness.LEAD,)), None
    # The error of a wrong set-up is not the actuator's: it is not searched for effects.
    reach = as_given if other is not None and other.enough else conclude
    result = reach(ready, settings, each, tell, effort)
    drawn = sampled(result, settings.evaluations, np.random.default_rng([seed, 1]), each, tell)
    tell('held-out', 0.0)
    both = both_parts.of(drawn, other, seed, each)
    used = None
    if prior is not None and known is not None:
        p_value = known.conflict(drawn.after.draws).p_value
        used = prior.used(known.components, known.quality, p_value)
    found = told(drawn, both, settings.false_alarms, used, seed, each)
    tell('done', 1.0)
    return found
