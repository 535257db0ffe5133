"""The final verdict: the answer of the fitting part, checked against the held-out part."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from actuator_glue.diagnosis.finding import Finding
from actuator_glue.diagnosis.thresholds import FAR_FROM_NOISE, LATER_SHARE, LIKELY, SOME_REMOVED
from actuator_glue.diagnosis.verdict.held_out import HeldOutError
from actuator_glue.diagnosis.verdicts import Verdict


def far(error: HeldOutError, material: float, left: float | None = None) -> bool:
    """Whether the held-out error is far above the noise: no such answer is complete.

    Not even where a single stretch, other parameters as likely as the best, or an onset account
    for the error. `left` is the error in question, `after` if not given [m].
    """
    left = error.after if left is None else left
    beyond = left**2 - error.noise_floor**2
    return beyond > max(material**2, (FAR_FROM_NOISE - 1.0) * error.noise_floor**2)


def misses(error: HeldOutError, material: float, left: float | None = None) -> bool:
    """Whether the held-out part shows more than noise: as much as an addition must remove.

    That is `material` [m] and a share of what was removed; not in a single stretch alone, unless
    it is far more. `left` is the error in question [m]; if not given, the least over all
    parameters that the fitting part leaves possible, or records' own zeros.
    """
    left, floor = error.least if left is None else left, error.noise_floor
    if far(error, material, left):
        return True
    removed = max(0.0, error.before**2 - error.after**2)
    matters = left**2 - floor**2 > max(material**2, LATER_SHARE**2 * removed)
    return matters and error.after_ci[0] * left > floor * error.after


def excused(error: HeldOutError, material: float) -> bool:
    """Whether other likely parameters, or records' own zeros, account for all beyond noise."""
    return misses(error, material, error.after) and not misses(error, material)


def takes_nothing(error: HeldOutError, material: float) -> bool:
    """Whether the additions at their best fit remove nothing of the held-out error.

    That is less than half of what matters: `material` [m]. A held-out part may show little of what
    matters in the fitting part: to remove all of it, beyond chance, is not nothing.
    """
    if error.removed_ci[0] > 0.0 and not misses(error, material, error.after):
        return False
    return error.before**2 - error.after**2 < (SOME_REMOVED * material) ** 2


def borne_out(error: HeldOutError, material: float) -> bool:
    """Whether the held-out part confirms the additions.

    Parameters that one stiffness leaves open may be far off under the next, more so with
    additions. Then parameters that both parts allow decide: whether they leave nothing with the
    additions, and something without.
    """
    if not takes_nothing(error, material):
        return True
    without = error.reached_before
    return without is not None and excused(error, material) and misses(error, material, without)


class Excuse(NamedTuple):
    """What accounts for all of a held-out error beyond noise.

    Attributes:
        before: excused error without the additions [m]; None where that is not known.
        after: excused error with them [m].
        how: the excuse, for people.
        otherwise: what the error without the excuse is called, for people.
    """

    before: float | None
    after: float
    how: str
    otherwise: str

    def sentence(self) -> str:
        """Return the excused error and the excuse, for people."""
        return f'{1e6 * self.after:.1f} um {self.how}'


def excuse(error: HeldOutError, material: float) -> Excuse | None:
    """Return what accounts for all beyond noise; None where nothing does."""
    if not excused(error, material):
        return None
    if error.reached is not None and error.reached <= error.least:
        how = 'with parameters as likely as the best'
        otherwise = 'with the best: the fitting records leave them open'
        return Excuse(error.reached_before, error.reached, how, otherwise)
    how = "without each record's own offset and drift"
    return Excuse(None, error.least, how, 'with them')


def of_both_parts(verdict: Verdict, acting: bool, error: HeldOutError, material: float) -> Verdict:
    """Return the verdict of both parts.

    Additions were chosen on the fitting part alone and stay in the model. Where they remove
    nothing in the held-out part, the records contradict each other (`undecided`). Where that part
    shows materially more than noise, or far more with the best parameters, no answer is complete:
    additions that remove error there beyond chance, or do so with parameters as likely, are a part
    of it (`unexplained`), without any the records contradict each other.

    Args:
        verdict: what the fitting part says.
        acting: whether an effect on the motion was added that acts in the held-out part.
        error: held-out error before and after.
        material: smallest error that matters [m].
    """
    if acting and not borne_out(error, material):
        return 'undecided'
    if verdict == 'unexplained' or not (misses(error, material) or far(error, material)):
        return verdict
    part = error.removed_ci[0] > 0.0 or takes_nothing(error, material)
    return 'unexplained' if acting and part else 'undecided'


def named(verdict: Verdict, effects: Sequence[Finding]) -> Verdict:
    """Return the verdict after weighing the names: with an improbable one it is not complete.

    Then the cause is something that the names tried describe badly.
    """
    if verdict == 'missing-effect' and not all(map(likely, effects)):
        return 'unexplained'
    return verdict


def likely(effect: Finding) -> bool:
    """Whether a name, or one of those tied with it, is more probably right than not.

    A finding without a probability is a description, or is measured directly.
    """
    if math.isnan(effect.probability):
        return True
    tied = (r.probability for r in effect.rivals if r.name in effect.alternatives)
    return effect.probability + sum(tied) >= LIKELY


def certainty(fitted: float, acting: bool, error: HeldOutError, material: float) -> float:
    """Return the factor on the names' share of the weight, in [0, 1].

    Args:
        fitted: that of the fitting part.
        acting: whether any addition acts in the held-out part.
        error: held-out error. Where it is more than noise, or additions at their best fit remove
            nothing of it, the factor is at most the share removed, with likely parameters at need.
        material: smallest error that matters [m].
    """
    nothing = acting and takes_nothing(error, material)
    if not (nothing or misses(error, material)):
        return fitted
    reached = nothing and borne_out(error, material)
    share = _share_reached(error) if reached else error.removable_removed
    return min(fitted, max(0.0, share))


def _share_reached(error: HeldOutError) -> float:
    """Return the share of Eq. (2)'s error that additions remove, both with likely parameters."""
    floor, without = error.noise_floor, error.reached_before or 0.0
    if not without > floor:
        return 0.0
    return (without**2 - error.least**2) / (without**2 - floor**2)


def against(
    verdict: Verdict, effects: Sequence[Finding], structure: Sequence[str], error: HeldOutError
) -> str:
    """Say why an estimator should not go on with the augmented model; empty where it may.

    Additions of one record only are no property of the machine; additions that the held-out part
    does not confirm would make forecasts worse.

    Args:
        verdict: of both parts.
        effects: the additions.
        structure: names of the augmented model's effects.
        error: held-out error before and after.
    """
    own = [e.name for e in effects if e.records]
    if verdict not in ('missing-effect', 'unexplained') or not structure:
        return 'nothing is supported that could be added'
    if own:
        return f'{", ".join(own)} does not act in all records'
    if not error.removed_ci[0] > 0.0:
        return 'the error that it removes in the held-out part does not exclude zero'
    return ''
