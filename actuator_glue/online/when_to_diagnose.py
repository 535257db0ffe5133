"""When a stream is diagnosed, and what follows: a state and a step, without clock, ROS or data.

A diagnosis is due when bands break and when the estimator's prior is contradicted; also, while
names are tied or structure remains, each time that the data received have doubled, and, while an
alarm stands, each time that the data since it began have doubled. It uses all data or, if a sound
machine has changed, the data since then: where there is a calibration, the estimator's earlier
posterior is its prior and stands for the other data. Its result replaces earlier additions: an
effect that later data contradict is taken out; one that they no longer support is carried beside
Eq. (2) until forecasts decide.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

import numpy as np
from scipy.special import ndtri

from actuator_glue.inference.choice import choose_model
from actuator_glue.online.structures import MOST, Proposal, Proposed

# A diagnosed structure that leads already is proposed anew if its weight is below this.
_DOUBTED = 0.5
# Weight of the leading structure beside a part of it that explains all data as well: it leads
# again once its mean square forecast error is lower by a fifth of the material error squared.
_MORE = 0.3
# Over this many times as many bands, half the tolerated lack of coverage is a break, too: an
# error of the noise's own size that never goes. Then the bands' level.
_LASTING, _LEVEL = 4, 0.95
# Forecasts that are off by this many standard deviations of their bands are a break as well: peaks
# cut off by a limit hardly change coverage. The worst band is left out: it may hold a glitch.
_OFF = 1.5
# Data of the changed machine to wait for before a diagnosis, if bands were good until now [s].
_CHANGED = 5.0
_GOES_ON = 'the estimator goes on as it is'


@dataclass(frozen=True, slots=True)
class LiveSettings:
    """When to diagnose by itself.

    Attributes:
        automatic: diagnose without being asked.
        apply: have the estimator carry the structures found.
        coverage_limit: mean coverage below which the noise band has broken; half as far below
            95 % where it lasts four times as long.
        coverage_windows: successive bands the mean is taken over.
        minimum: data needed before a diagnosis [s].
        pause: data that must have come since the previous diagnosis began [s].
    """

    automatic: bool = True
    apply: bool = False
    coverage_limit: float = 0.8
    coverage_windows: int = 5
    minimum: float = 15.0
    pause: float = 10.0


@dataclass(frozen=True, slots=True)
class Received:
    """Usable data received since the stream began [s]."""

    seconds: float


@dataclass(frozen=True, slots=True)
class Judged:
    """A band of parameters and sensor noise was compared with its samples.

    Attributes:
        coverage: share of the samples that it covers.
        number: window that made it.
        error: rms of measured minus median, in standard deviations of the band.
    """

    coverage: float
    number: int = 0
    error: float = 1.0

    @staticmethod
    def of(coverage: float, number: int, rms_error: float, width: float, level: float) -> Judged:
        """Return how a band was judged.

        Args:
            coverage: share of the samples that it covers.
            number: window that made it.
            rms_error: of measured minus median [m].
            width: mean width of the interval [m].
            level: probability of the interval.
        """
        deviation = width / (2.0 * ndtri(0.5 + 0.5 * level))
        return Judged(coverage, number, rms_error / deviation if deviation > 0.0 else math.inf)


@dataclass(frozen=True, slots=True)
class Carries:
    """The estimator carries other structures from a window on; earlier bands do not count."""

    number: int


@dataclass(frozen=True, slots=True)
class Estimated:
    """A window has a posterior.

    Attributes:
        contradicted: the alarm of the check of the prior stands.
        weights: effects and weight of each structure that is carried, the likeliest first.
        contradicts: data since the first sample that contradicts [s]; NaN where none does.
    """

    contradicted: bool
    weights: tuple[tuple[frozenset[str], float], ...]
    contradicts: float = math.nan


@dataclass(frozen=True, slots=True)
class Began:
    """Windows begin anew: a gap, another test, or the stream began again."""


@dataclass(frozen=True, slots=True)
class Requested:
    """Somebody has asked for a diagnosis, which begins now.

    Attributes:
        streamed: it is of the data received, not of other records.
    """

    streamed: bool = True


@dataclass(frozen=True, slots=True)
class GivenUp:
    """A diagnosis has ended without a result."""


@dataclass(frozen=True, slots=True)
class Concluded:
    """A diagnosis has a result.

    Attributes:
        proposal: what the estimator should carry; None where it should go on as it is.
        why_not: why there is no proposal, for people.
        left_open: names are tied, or structure remains.
        apply: the estimator is to carry it; None for what the settings say.
        supported: effects that the data support, whether they may be carried or not; None if
            unknown.
    """

    proposal: Proposal | None = None
    why_not: str = ''
    left_open: bool = False
    apply: bool | None = None
    supported: frozenset[str] | None = None


Input: TypeAlias = (
    Received | Judged | Carries | Estimated | Began | Requested | GivenUp | Concluded
)
# What is diagnosed now, if anything.
Diagnosing: TypeAlias = Literal['', 'the stream', 'other records', 'another actuator']


@dataclass(frozen=True, slots=True)
class Look:
    """Diagnose the data received, for a reason.

    Attributes:
        reason: why, for people.
        since: earlier data to leave out [s]; they enter through the prior (`memory.looked_at`).
    """

    reason: str
    since: float = 0.0


@dataclass(frozen=True, slots=True)
class Carry:
    """Have the estimator carry other structures.

    Attributes:
        proposal: structures to carry.
        taken_out: effects that are no longer carried.
    """

    proposal: Proposal
    taken_out: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Say:
    """Tell people."""

    kind: str
    message: str


Action: TypeAlias = Look | Carry | Say


@dataclass(frozen=True, slots=True)
class LiveState:
    """The state of a live diagnosis: all that decides what is done next.

    Attributes:
        settings: when to diagnose.
        seconds: data received since the stream began [s].
        coverages: of the last bands.
        errors: of the last bands, in standard deviations of each band.
        judged: data received when each of these bands was judged [s].
        origin: data that diagnoses leave out [s]: those before a machine to which nothing was
            added changed, suddenly or slowly.
        broken: bands say that the model lacks something.
        contradicted: the alarm of the check of the prior stands.
        since: first window with the structures carried now.
        weights: structures that are carried, the likeliest first.
        reason: why a diagnosis is due; empty for none.
        diagnosing: what the diagnosis is of that is under way; empty without one.
        looked: data received when the last diagnosis began [s]; NaN before the first.
        left_open: the last diagnosis left names tied, or structure in the residual.
        sound: bands of the structures carried now have been good.
        alarm: data received when the standing alarm began [s]; NaN without an alarm.
        ready: data required before a diagnosis for that alarm [s].
    """

    settings: LiveSettings
    seconds: float = 0.0
    coverages: tuple[float, ...] = ()
    errors: tuple[float, ...] = ()
    judged: tuple[float, ...] = ()
    origin: float = 0.0
    broken: bool = False
    contradicted: bool = False
    since: int = 0
    weights: tuple[tuple[frozenset[str], float], ...] = ()
    reason: str = ''
    diagnosing: Diagnosing = ''
    looked: float = math.nan
    left_open: bool = False
    sound: bool = False
    alarm: float = math.nan
    ready: float = 0.0

    @property
    def coverage(self) -> float:
        """Mean coverage of the last bands; NaN before there are enough."""
        count = self.settings.coverage_windows
        return (
            float(np.mean(self.coverages[-count:])) if len(self.coverages) >= count else math.nan
        )

    @property
    def lasting(self) -> bool:
        """Whether coverage has been moderately low for long."""
        limit = 0.5 * (self.settings.coverage_limit + _LEVEL)
        full = len(self.coverages) >= _LASTING * self.settings.coverage_windows
        return full and float(np.mean(self.coverages)) < limit

    @property
    def off(self) -> float:
        """Rms error of the last bands except the worst, in standard deviations of the bands.

        Over four times as many bands as the mean coverage; NaN before there are enough.
        """
        full = len(self.errors) >= _LASTING * self.settings.coverage_windows
        return float(np.sqrt(np.mean(np.square(sorted(self.errors)[:-1])))) if full else math.nan

    @property
    def wanting(self) -> bool:
        """Whether bands say that the model lacks something."""
        low = self.coverage < self.settings.coverage_limit
        return low or self.lasting or self.off > _OFF

    @property
    def trusted(self) -> bool:
        """Whether bands have been judged, and neither they nor the prior's check alarm."""
        fair = not math.isnan(self.coverage) and not self.wanting
        return fair and not self.contradicted


def init(settings: LiveSettings) -> LiveState:
    """Return the state before a stream."""
    return LiveState(settings)


def step(state: LiveState, given: Input) -> tuple[LiveState, tuple[Action, ...]]:
    """Take one input; return the next state and what to do."""
    told: tuple[Action, ...] = ()
    match given:
        case Received():
            state = _received(state, given.seconds)
        case Judged():
            state, told = _judged(state, given)
        case Carries():
            state = replace(_began(state), since=given.number)
        case Estimated():
            state, told = _estimated(state, given)
        case Began():
            state = _began(state)
        case Requested():
            if not given.streamed:
                return replace(state, diagnosing='other records'), ()
            return replace(state, diagnosing='the stream', looked=state.seconds), ()
        case GivenUp():
            state = replace(state, diagnosing='')
        case Concluded():
            state, told = _concluded(state, given)
    state = _timed(state)
    reason = _due(state)
    if not reason:
        return state, told
    state = replace(state, diagnosing='the stream', looked=state.seconds, reason='')
    return state, (*told, Look(reason, state.origin))


def _judged(state: LiveState, given: Judged) -> tuple[LiveState, tuple[Action, ...]]:
    if given.number < state.since:
        return state, ()
    most = _LASTING * state.settings.coverage_windows
    state = replace(
        state,
        coverages=(*state.coverages, given.coverage)[-most:],
        errors=(*state.errors, given.error)[-most:],
        judged=(*state.judged, state.seconds)[-most:],
    )
    broken = state.wanting
    sound = state.sound or state.coverage >= state.settings.coverage_limit
    if math.isnan(state.coverage) or broken == state.broken:
        return replace(state, sound=sound), ()
    if not broken:
        return replace(state, broken=False, sound=True), ()
    # A few very bad bands lower the mean of many, too.
    low = state.coverage < state.settings.coverage_limit
    sudden = state.sound and low
    state = replace(state, ready=state.seconds + _CHANGED * sudden)
    if state.sound and (low or state.off > _OFF) and not (state.weights and state.weights[0][0]):
        state = replace(state, origin=_changed(state, low), left_open=False)
        if not low:
            # Only a few peaks are off: it takes more data to show what is missing.
            state = replace(state, ready=state.origin + state.settings.minimum)
    covers = state.coverage if low else float(np.mean(state.coverages))
    what = f'the band of parameters and sensor noise covers {covers:.0%} of the samples'
    if not (low or state.lasting):
        what += f', and forecasts are off by {state.off:.1f} times what it holds'
    what += ': the model lacks something'
    return replace(state, broken=True, reason=what), (Say('coverage', what),)


def _changed(state: LiveState, low: bool) -> float:
    """Return the data received when the last band before the bad ones was judged [s].

    Args:
        state: state whose bands show a change.
        low: the change shows as low coverage, not as large forecast errors.
    """
    if low:
        lately = state.coverages[-state.settings.coverage_windows - 1 :]
        bad = [coverage < state.settings.coverage_limit for coverage in lately]
    else:
        bad = [error > _OFF for error in state.errors]
    first = bad.index(True) if any(bad) else 0
    return state.judged[first - len(bad) - 1] if first > 0 else state.origin


def _estimated(state: LiveState, given: Estimated) -> tuple[LiveState, tuple[Action, ...]]:
    rises = given.contradicted and not state.contradicted
    state = replace(state, contradicted=given.contradicted, weights=given.weights)
    if not rises:
        return state, ()
    what = 'samples contradict what the estimator knew of the parameters'
    state = replace(state, reason=state.reason or what)
    began = max(state.seconds - given.contradicts, 0.0)
    sound = state.sound and not state.broken and not (state.weights and state.weights[0][0])
    if sound and state.origin == 0.0 and math.isfinite(began):
        # A slow change, which windows follow: among all data, those before it would prevail.
        # A later alarm is of the same change.
        ready = max(state.ready, began + state.settings.minimum)
        state = replace(state, origin=began, left_open=False, ready=ready)
    return state, ()


def _received(state: LiveState, seconds: float) -> LiveState:
    """Take the amount of data received; less than before means another actuator."""
    if seconds >= state.seconds:
        return replace(state, seconds=seconds)
    goes_on = 'another actuator' if state.diagnosing == 'the stream' else state.diagnosing
    return LiveState(state.settings, seconds, diagnosing=goes_on)


def _began(state: LiveState) -> LiveState:
    """Drop the bands, which are of earlier windows."""
    return replace(
        state, coverages=(), errors=(), judged=(), broken=False, sound=False, alarm=math.nan
    )


def _timed(state: LiveState) -> LiveState:
    """Note when an alarm began."""
    if not (state.broken or state.contradicted):
        return replace(state, alarm=math.nan)
    return replace(state, alarm=state.seconds) if math.isnan(state.alarm) else state


def _concluded(state: LiveState, given: Concluded) -> tuple[LiveState, tuple[Action, ...]]:
    of, state = state.diagnosing, replace(state, diagnosing='')
    if of == 'the stream':
        # An alarm raised meanwhile is of samples mostly diagnosed, or of structures replaced now.
        state = replace(state, left_open=given.left_open, reason='')
    apply = state.settings.apply if given.apply is None else given.apply
    if not apply:
        return state, ()
    if of == 'another actuator':
        return state, (Say('diagnosis', f'{_GOES_ON}: the samples are of another actuator now'),)
    leading, weight = state.weights[0] if state.weights else (frozenset(), 1.0)
    if given.proposal is None:
        doubted = () if given.supported is None else tuple(sorted(leading - given.supported))
        if doubted:
            doubt = Say('in doubt', f'{", ".join(doubted)}: {given.why_not}')
            return _began(state), (doubt, Carry(_evenly(leading)))
        said = (Say('diagnosis', f'{_GOES_ON}: {given.why_not}'),)
        return state, said if given.why_not else ()
    wanted = frozenset(given.proposal.structures[0].model.effects)
    out = tuple(sorted(leading - wanted))
    if wanted == leading and weight >= _DOUBTED:
        # Effects in doubt that neither forecasts nor this diagnosis have confirmed are taken out.
        asked = {frozenset(one.model.effects) for one in given.proposal.structures}
        more = [effects for effects, _ in state.weights if effects > wanted]
        out = tuple(sorted({name for one in more if one not in asked for name in one - wanted}))
        if not out:
            return state, ()
    if wanted and wanted < leading and weight >= _DOUBTED:
        # A diagnosis says what is material in all data; forecasts, what the other effects add.
        doubt = Say('in doubt', f'{", ".join(out)}: all data are explained as well without')
        return _began(state), (doubt, Carry(_without(leading, given.proposal)))
    carried = {effects for effects, _ in state.weights}
    if leading and not wanted and frozenset() not in carried:
        # Forecasts have excluded Eq. (2), a diagnosis of few data has not: they decide once more.
        doubt = Say('in doubt', f'{", ".join(out)}: Eq. (2) is enough for what was looked at')
        return _began(state), (doubt, Carry(_evenly(leading)))
    told: tuple[Action, ...] = ()
    if out:
        told = (Say('taken out', f'{", ".join(out)}: later data contradict it'),)
    return _began(state), (*told, Carry(given.proposal, out))


def _evenly(effects: frozenset[str]) -> Proposal:
    """Return Eq. (2) with and without effects, equally likely: forecasts decide."""
    both = tuple(sorted(effects)), ()
    return Proposal(tuple(Proposed(choose_model(names), 0.5) for names in both))


def _without(effects: frozenset[str], fewer: Proposal) -> Proposal:
    """Return the smaller proposal with the leading effects beside it: forecasts decide."""
    ours = fewer.structures[: MOST - 1]
    total = sum(one.weight for one in ours)
    less = [replace(one, weight=(1.0 - _MORE) * one.weight / total) for one in ours]
    more = Proposed(choose_model(tuple(sorted(effects))), _MORE)
    return replace(fewer, structures=(*less, more))


def _due(state: LiveState) -> str:
    """Return why a diagnosis is due; empty where none is."""
    settings, seconds = state.settings, state.seconds
    if state.diagnosing or not settings.automatic or seconds < settings.minimum:
        return ''
    paused = seconds < state.looked + settings.pause
    if state.reason and not paused and seconds >= state.ready:
        return state.reason
    data, seen = seconds - state.origin, state.looked - state.origin
    if data >= 2.0 * seen and not paused:
        if state.left_open:
            return 'names are tied or structure remains, and there are twice as many data'
        if state.weights and state.weights[0][0] and data >= 2.0 * settings.minimum:
            # An effect that grows with time is small at first; windows follow a slow change.
            return 'there are twice as many data as what was added was found in'
    # NaN without an alarm: there is nothing to diagnose again.
    again = max(state.alarm, state.looked) + max(settings.pause, state.looked - state.alarm)
    if seconds >= max(again, state.ready) and seconds != state.looked:
        return 'the alarm still stands, and there are more data since it began'
    return ''
