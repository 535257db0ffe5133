"""The online estimator as a state machine: samples in, jobs out, results back in."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.inference.carried import Carried
from actuator_glue.inference.choice import ModelChoice
from actuator_glue.online.ahead import Ahead
from actuator_glue.online.carried_structures import CarriedStructure, CarriedStructures
from actuator_glue.online.fitting import starting_points
from actuator_glue.online.forecast import FrozenPosterior
from actuator_glue.online.job import WindowResult
from actuator_glue.online.schedule import Begun, ReplayPosition, Schedule
from actuator_glue.online.settings import EstimatorSettings
from actuator_glue.online.stream import (
    Dropped,
    Event,
    Failed,
    Preview,
    Rejected,
    Window,
)
from actuator_glue.online.structures import Proposal
from actuator_glue.online.window_posterior import MOST_PATIENCE, Job, WindowFit
from actuator_glue.online.windows import SlidingWindows, Tally
from actuator_glue.records import Array
from actuator_glue.sample_block import Block
from actuator_glue.setups import StreamSetup

# Forecasts wait for their samples for two or three hops; more only when windows are dropped.
MAX_FROZEN = 8
# After a stall of the whole computer several hops arrive at once.
MAX_WAITING = 4
# Factor on the patience after each window that has a posterior.
_CALMER = 0.8
# A less likely structure is sampled anew after this share of a window's length: sooner, hardly any
# samples are new.
NEWS = 0.1


@dataclass(slots=True)
class _Beside:
    """A structure that is sampled beside the likeliest one.

    Attributes:
        member: the structure.
        job: the job of sampling it.
        handed: the job was handed out.
        result: result of the job; None before it has come.
        joins: the running job uses the result.
    """

    member: CarriedStructure
    job: Job
    handed: bool = False
    result: WindowFit | None = None
    joins: bool = False


@dataclass(slots=True)
class _Before:
    """Where the last result of the likeliest structure ended."""

    archive: Array
    model: ModelChoice
    epoch: int


def _patience(before: float, result: WindowResult | WindowFit) -> float:
    """Return the next window's time limit, in budgets.

    Doubled after a window that ran out of time before it had a posterior: the next one would
    otherwise begin, and end, where that did. Lowered again after each window with a posterior.
    """
    if result.starved:
        return min(2.0 * before, MOST_PATIENCE)
    return before if result.failure else max(1.0, _CALMER * before)


class Estimator:
    """Windows, warm start and forecasts; knows no clock, no process and no ROS.

    `push` what arrives, ask `next_job`, compute it wherever you like with `job.run`, hand the
    result to `finish`. One job is out at a time. Where several structures are carried, a job
    samples the likeliest; ask `rival_job` after each `finish`, compute it in parallel with
    `job.renew`, and hand its result to `finish_rival` at any time: the next job uses it. The
    results depend on the samples, the settings, which windows were dropped or stopped early, and
    which used a rival's result: a `Schedule` repeats those.

    Args:
        settings: settings; they do not change.
        model: model to fit, or several structures; also what another actuator begins with.
        live: a few windows wait, so that a slow computer drops windows instead of falling
            behind; otherwise every window waits its turn.
        schedule: repeats a live run.
        carried: draws of an earlier calibration, for the priors that start from one.
    """

    def __init__(
        self,
        settings: EstimatorSettings,
        model: ModelChoice | Proposal,
        *,
        live: bool = False,
        schedule: Schedule | None = None,
        carried: Carried | None = None,
    ) -> None:
        self.settings = settings
        self._first = Proposal.of(model)
        self._members = CarriedStructures(settings, carried, self._first)
        self.live = live
        self.schedule = schedule
        self.running: Job | None = None
        self._windows = SlidingWindows(settings)
        self._waiting: list[Window] = []
        self._applied = 0  # number of the schedule's models in use so far
        self._course = ReplayPosition()
        self._before: _Before | None = None
        self._epoch: int | None = None
        self._patience = 1.0
        self._frozen: list[FrozenPosterior] = []
        self._pending: Proposal | None = None
        self._beside: _Beside | None = None
        self._ahead = Ahead()

    @property
    def model(self) -> ModelChoice:
        """The likeliest structure, or the one that the next window begins with."""
        proposal = self._pending
        return self._members.leading.model if proposal is None else proposal.structures[0].model

    @property
    def proposal(self) -> Proposal:
        """What is carried, as it was proposed last."""
        return self._members.proposal

    @property
    def weights(self) -> tuple[tuple[ModelChoice, float], ...]:
        """The structures that are carried and their weights, the likeliest first."""
        return self._members.weights

    @property
    def tally(self) -> Tally:
        """Counts since the start."""
        return self._windows.tally

    @property
    def test(self) -> StreamSetup | None:
        """The test set-up that holds."""
        return self._windows.current

    @property
    def unused(self) -> str:
        """Why the samples that come now are not estimated with; empty where they are."""
        return self._windows.unused

    @property
    def waiting(self) -> tuple[Window, ...]:
        """The windows that wait, the next one first."""
        return tuple(self._waiting)

    def setup(self, setup: StreamSetup) -> list[Event]:
        """Take a test set-up."""
        return self._windows.setup(setup)

    def push(self, block: Block) -> list[Event]:
        """Take one block of samples as it came; unusable ones are told, never raised."""
        events, windows = self._windows.push(block)
        for window in windows:
            if self._formed_live(window):
                for member in self._members:
                    member.knowledge.formed(window)
            planned = self._planned(window)
            if planned is None:
                continue
            self._waiting.append(planned)
            if self.live and len(self._waiting) > MAX_WAITING:
                events.append(self._drop())
        # A window that waits forecasts from its own end on.
        ends = [window.end for window in self._waiting]
        self._ahead.forget(min([block.index, *ends]))
        return events

    def preview(self, preview: Preview) -> list[Event]:
        """Take commands that will be acted on."""
        try:
            self._ahead.take(preview)
        except InputError as error:
            return [Rejected(str(error))]
        return []

    def set_model(self, model: ModelChoice | Proposal) -> None:
        """Go on with another model, or several structures, until the actuator is another one."""
        self._pending = Proposal.of(model)

    def drop(self, late: Callable[[Window], bool]) -> list[Event]:
        """Drop waiting windows that are too late; the newest is always kept."""
        events: list[Event] = []
        while len(self._waiting) > 1 and late(self._waiting[0]):
            events.append(self._drop())
        return events

    def next_job(self) -> Job | None:
        """Return the next job, or None where there is nothing to do or one is running."""
        if self.running is not None or not self._waiting:
            return None
        window = self._waiting.pop(0)
        proposal = self._proposed(window)
        if proposal is not None:
            self._begin(proposal)
        self._epoch = window.epoch
        stops: tuple[int | None, ...] = (None,) * len(self._members)
        if self.schedule is not None:
            stops = self.schedule.done[_key(window)][1]
            self._resume(window, self.schedule.begun.get(window.number))
            if not self._course.exact or len(stops) != len(self._members):
                stops = (None,) * len(self._members)
        self._take_in(window, stops)
        job = self._job(self._members.leading, window, stops[0])
        weight, *shares = self._members.shares().tolist()
        rivals = zip(self._members.rivals, shares, strict=True)
        self.running = replace(
            job,
            ahead=self._ahead.between(window.end, job.forecast[1], window.record.period),
            frozen=self._judged(window),
            weight=weight,
            rivals=tuple(self._rival(member, window, share) for member, share in rivals),
            proposal=None if proposal is None else self.proposal,
        )
        return self.running

    def rival_job(self) -> Job | None:
        """Return, once, the job for `job.renew` of a less likely structure; None without one."""
        beside = self._beside
        if beside is None or beside.handed:
            return None
        beside.handed = True
        return beside.job

    def finish_rival(self, result: WindowFit) -> None:
        """Take the result of a rival's job; one that is no longer wanted is dropped."""
        beside = self._beside
        if beside is None or beside.result is not None:
            return
        wanted = beside.job
        if (result.window.number, result.model) == (wanted.window.number, wanted.model):
            beside.result = result

    def abandon_rival(self) -> None:
        """Have `rival_job` return the same job once more: its process has died."""
        if self._beside is not None and self._beside.result is None:
            self._beside.handed = False

    def _take_in(self, window: Window, stops: Sequence[int | None]) -> None:
        """Decide whether a window uses the result of a rival's job.

        Live if it has come by now; in a replay if the live window used it.
        """
        beside = self._beside
        if beside is None:
            return
        if beside.job.window.epoch != window.epoch:
            self._beside = None  # of another actuator
            return
        stop = next(
            stop
            for member, stop in zip(self._members, stops, strict=True)
            if member is beside.member
        )
        beside.joins = beside.result is not None and stop != 0

    def _rival(self, member: CarriedStructure, window: Window, weight: float) -> Job:
        """Return the job of a less likely structure, which only forecasts from a window on."""
        standing = member.frozen if member.epoch == window.epoch else None
        beside, renewed = self._beside, 0
        if beside is not None and beside.joins and beside.member is member:
            assert beside.result is not None
            renewed, standing = beside.result.evaluations, beside.result.frozen or standing
        return Job(
            window=window,
            settings=self.settings,
            model=member.model,
            standing=standing,
            renewed=renewed,
            weight=weight,
        )

    def _resume(self, window: Window, begun: Begun | None) -> None:
        """Start from the live run's points if the window before could not be recomputed."""
        if self._course.resumes(begun) and begun is not None and begun.archive is not None:
            leading = self._members.leading
            if begun.archive.shape[1] == len(leading.model.names):
                leading.archive, leading.epoch = begun.archive, window.epoch
        self._course.done(window.number)

    def _job(self, member: CarriedStructure, window: Window, stop: int | None) -> Job:
        """Return the job of sampling one structure in a window."""
        model, record = member.model, window.record
        prior, before = member.knowledge.prior(window), self._before
        archive, afresh = None, True
        if member.archive is not None and member.epoch == window.epoch:
            afresh, archive = False, starting_points(model, model.names, member.archive, ())
        elif before is not None and before.epoch == window.epoch:
            seed = (self.settings.seed, record.first_index, 2)
            known, points = before.model.names, before.archive
            if prior is not None:
                # The prior is closer than the points where another model ended.
                known = prior.names
                points = prior.points(len(points), np.random.default_rng((*seed, 1)))
            archive = starting_points(model, known, points, seed)
        return Job(
            window=window,
            settings=self.settings,
            model=model,
            archive=archive,
            afresh=afresh,
            stop_at=stop,
            prior=prior,
            patience=self._patience,
        )

    def finish(self, result: WindowResult | WindowFit) -> list[Event]:
        """Take the running job's result; its first part, which the next job needs, is enough."""
        self.running = None
        window = result.window
        self._patience = _patience(self._patience, result)
        if result.failure:
            # A replay leaves such windows out: nothing but time limits may depend on them.
            return [Failed(window.number, window.record.first_index, result.failure)]
        self._frozen = [
            f for f in self._frozen if f.segment == window.segment and f.stop > window.end
        ]
        if result.frozen is not None:
            self._frozen.append(result.frozen)
            del self._frozen[:-MAX_FROZEN]
        for member in self._members:
            member.waited += 1
        events: list[Event] = list(self._members.leading.learn(result))
        if self._beside is not None and self._beside.joins:
            assert self._beside.result is not None
            # That a window contradicts the prior of a less likely structure is not reported.
            self._beside.member.learn(self._beside.result)
            self._beside = None
        leading = self._members.leading
        if leading.archive is not None:
            self._before = _Before(leading.archive, leading.model, leading.epoch)
        events += self._members.weigh(result)
        self._sample_beside(window)
        return events

    def _sample_beside(self, window: Window) -> None:
        """Choose the less likely structure that has waited longest, if none is being sampled.

        Only after a window that is published, which a replay has, too.
        """
        rivals = self._members.rivals
        if self._beside is not None and not any(self._beside.member is one for one in rivals):
            self._beside = None
        news = math.ceil(NEWS * self.settings.window / self.settings.hop)
        due = [
            one
            for one in rivals
            if one.frozen is None or one.epoch != window.epoch or one.waited >= news
        ]
        if self._beside is None and due:
            longest = max(due, key=lambda member: member.waited)
            self._beside = _Beside(longest, self._job(longest, window, None))

    def _begin(self, proposal: Proposal) -> None:
        """Carry these structures from now on."""
        self._pending = self._beside = None
        self._members.begin(proposal)

    def abandon(self, reason: str) -> list[Event]:
        """Give up the running job, whose process has died."""
        job, self.running = self.running, None
        if job is None:
            return []
        return [Failed(job.window.number, job.window.record.first_index, reason)]

    def _drop(self) -> Dropped:
        """Drop the oldest of several windows; the next one keeps what shows the channels."""
        old = self._waiting.pop(0)
        if old.stretch is not None:
            self._waiting[0] = replace(self._waiting[0], stretch=old.stretch)
        return Dropped(old.number, old.record.first_index)

    def _judged(self, window: Window) -> tuple[FrozenPosterior, ...]:
        """Return the earlier posteriors whose forecasts a window's samples judge."""
        first = window.recent.first_index
        # Those for which all commands since their windows' ends are known.
        return tuple(
            f
            for f in self._frozen
            if f.segment == window.segment and first <= f.end and f.stop <= window.end
        )

    def _formed_live(self, window: Window) -> bool:
        """Whether the live run formed a window, too: in a replay it may have begun later."""
        if self.schedule is None or self.schedule.formed_ns is None:
            return True
        return window.record.start_ns >= self.schedule.formed_ns

    def _planned(self, window: Window) -> Window | None:
        """Return a window as the schedule numbers it; None where the live run dropped it."""
        if self.schedule is None:
            return window
        done = self.schedule.done.get(_key(window))
        return None if done is None else replace(window, number=done[0])

    def _proposed(self, window: Window) -> Proposal | None:
        """Return the proposal to carry from a window on; None where it is not new.

        What was found on one actuator says nothing about another. Of a schedule, those before it
        are begun with here: their windows failed, and are not in the bag.
        """
        if self.schedule is None:
            other = self._epoch not in (None, window.epoch) and self.proposal != self._first
            return self._pending or (self._first if other else None)
        due = [model for number, model in self.schedule.models if number <= window.number]
        if len(due) == self._applied:
            return None
        for passed in due[self._applied : -1]:
            self._begin(Proposal.of(passed))
        self._applied = len(due)
        return Proposal.of(due[-1])


def _key(window: Window) -> tuple[int, int]:
    return window.record.first_index, window.record.start_ns
