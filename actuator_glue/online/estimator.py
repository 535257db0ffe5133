"""The online estimator as a state machine: samples in, jobs out, results back in."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.inference.carried import Carried
from actuator_glue.inference.choice import ModelChoice
from actuator_glue.online import structures
from actuator_glue.online.ahead import Ahead
from actuator_glue.online.fitting import starting_points
from actuator_glue.online.forecast import FrozenPosterior
from actuator_glue.online.job import WindowResult
from actuator_glue.online.knowledge import Knowledge
from actuator_glue.online.schedule import Begun, ReplayPosition, Schedule
from actuator_glue.online.settings import EstimatorSettings
from actuator_glue.online.stream import (
    Contradicted,
    Dropped,
    Event,
    Failed,
    Preview,
    Rejected,
    Reweighed,
    Window,
    structure_name,
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


@dataclass(slots=True, eq=False)
class _Member:
    """A structure that is carried, and what it keeps of its last result.

    Attributes:
        model: the structure.
        knowledge: what earlier samples say of its parameters.
        archive: points that its next window starts from.
        epoch: actuator of these points.
        frozen: its last posterior, with which it forecasts while it is not sampled.
        waited: windows since its last result.
        before: it is a reference that new structures must beat: Eq. (2), or carried before them.
        worse: successive windows in which its forecasts were worse than a reference's.
    """

    model: ModelChoice
    knowledge: Knowledge
    archive: Array | None = None
    epoch: int = -1
    frozen: FrozenPosterior | None = None
    waited: int = 0
    before: bool = False
    worse: int = 0


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

    member: _Member
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
        model: model to fit, or several structures.
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
        self.proposal = Proposal.of(model)
        self.live = live
        self.schedule = schedule
        self.running: Job | None = None
        self._windows = SlidingWindows(settings)
        self._waiting: list[Window] = []
        self._carried = carried
        self._applied = 0  # number of the schedule's models in use so far
        self._course = ReplayPosition()
        self._before: _Before | None = None
        self._patience = 1.0
        self._frozen: list[FrozenPosterior] = []
        self._judged_to: int | None = None
        self._pending: Proposal | None = None
        self._members: list[_Member] = []
        self._log_prior = self._evidence = np.zeros(0)
        self._beside: _Beside | None = None
        self._begin(self.proposal)
        self._ahead = Ahead()

    @property
    def model(self) -> ModelChoice:
        """The likeliest structure, or the one that the next window begins with."""
        proposal = self._pending
        return self._members[0].model if proposal is None else proposal.structures[0].model

    @property
    def weights(self) -> tuple[tuple[ModelChoice, float], ...]:
        """The structures that are carried and their weights, the likeliest first."""
        found = zip(self._members, self._shares().tolist(), strict=True)
        return tuple((member.model, share) for member, share in found if share > 0.0)

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
        """Go on with another model, or several structures, from the next job on."""
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
        stops: tuple[int | None, ...] = (None,) * len(self._members)
        if self.schedule is not None:
            stops = self.schedule.done[_key(window)][1]
            self._resume(window, self.schedule.begun.get(window.number))
            if not self._course.exact or len(stops) != len(self._members):
                stops = (None,) * len(self._members)
        self._take_in(window, stops)
        job = self._job(self._members[0], window, stops[0])
        weight, *shares = self._shares().tolist()
        rivals = zip(self._members[1:], shares, strict=True)
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

    def _rival(self, member: _Member, window: Window, weight: float) -> Job:
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
            leading = self._members[0]
            if begun.archive.shape[1] == len(leading.model.names):
                leading.archive, leading.epoch = begun.archive, window.epoch
        self._course.done(window.number)

    def _job(self, member: _Member, window: Window, stop: int | None) -> Job:
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
        events: list[Event] = list(_learned(self._members[0], result))
        if self._beside is not None and self._beside.joins:
            assert self._beside.result is not None
            # That a window contradicts the prior of a less likely structure is not reported.
            _learned(self._beside.member, self._beside.result)
            self._beside = None
        leading = self._members[0]
        if leading.archive is not None:
            self._before = _Before(leading.archive, leading.model, leading.epoch)
        events += self._weigh(result)
        self._sample_beside(window)
        return events

    def _sample_beside(self, window: Window) -> None:
        """Choose the less likely structure that has waited longest, if none is being sampled.

        Only after a window that is published, which a replay has, too.
        """
        rivals = self._members[1:]
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
        """Carry these structures from now on; a structure carried before keeps its knowledge.

        Unless the proposal begins afresh: then only the points that its next window starts from.

        Where there are several, Eq. (2) and the structures carried before are the references
        that the others have to beat.
        """
        self._pending = self._beside = None
        led = self._members[0] if self._members else None
        began = None if led is None else led.knowledge.began_ns
        old = {frozenset(member.model.effects): member for member in self._members}
        carried = [(frozenset(model.effects), share) for model, share in self.weights]
        self._members, told = [], []
        for one in proposal.structures:
            member = None if one.known is not None else old.get(frozenset(one.model.effects))
            if member is None or _box(member.model) != _box(one.model):
                known = Knowledge(self.settings, self._carried, one.known, began)
                member = _Member(one.model, known)
            elif proposal.afresh:
                member.knowledge = Knowledge(self.settings, self._carried, None, began)
            member.before, member.worse = False, 0
            self._members.append(member)
            told.append(replace(one, model=member.model))
        self.proposal = replace(proposal, structures=tuple(told))
        self._log_prior = proposal.log_weights
        if len(self._members) > 1:
            for member in self._members:
                member.before = not member.model.effects
            names = {frozenset(member.model.effects) for member in self._members}
            most = structures.most_in_all(self.settings.window, self.settings.hop)
            for effects, share in carried[: structures.MOST]:
                if effects in names or len(self._members) == most:
                    continue
                stays = old[effects]
                stays.before, stays.worse = True, 0
                weight = max(structures.BEFORE * share, structures.BESIDE)
                self._members.append(stays)
                self._log_prior = np.append(self._log_prior, np.log(weight))
        self._evidence = np.zeros(len(self._members))
        self._judged_to = None

    def _shares(self) -> Array:
        """Return the weights (K,) of all members; 0 for one kept only as a reference."""
        return structures.weights(self._log_prior, self._evidence)

    def _weigh(self, result: WindowResult | WindowFit) -> list[Event]:
        """Update weights by the forecasts a window judged; drop structures of little weight."""
        if len(self._members) < 2 or not result.errors:
            return []
        settings, window = self.settings, result.window
        since = settings.hop
        if self._judged_to is not None:
            since = max(since, (window.end - self._judged_to) * window.record.period)
        self._judged_to = window.end
        material = self.proposal.material
        if np.isnan(material) and result.frozen is not None:
            material = structures.MATERIAL * result.frozen.noise
        memory = structures.MEMORY * settings.window
        self._evidence = structures.moved(self._evidence, result.errors, material, since, memory)
        before = self._members[0].model
        worse = self._outdone(result.errors, material)
        shares = self._shares()
        carried = np.isfinite(self._log_prior)
        order = [int(i) for i in np.argsort(-shares, kind='stable')]
        out = [i for i in order if shares[i] < structures.LEAVES]
        left = [self._members[i].model for i in out if carried[i]]
        left = [before, *left] if worse else left
        # Eq. (2) takes no time and stays as a reference for what the others add.
        self._log_prior[out] = -np.inf
        kept = [i for i in order if i not in out or self._compared(i)]
        self._members = [self._members[i] for i in kept]
        self._log_prior, self._evidence = self._log_prior[kept], self._evidence[kept]
        if not left and self._members[0].model is before:
            return []
        now = tuple((model.effects, share) for model, share in self.weights)
        said = ', '.join(f'{structure_name(name)} {share:.0%}' for name, share in now)
        gone = ', '.join(structure_name(model.effects) for model in left)
        return [
            Reweighed(
                window.number,
                window.end,
                now,
                tuple(model.effects for model in left),
                f'forecasts up to sample {window.end} weigh {said}'
                + (f'; no longer carried: {gone}' if gone else '')
                + (f'; {structure_name(before.effects)} made them worse' if worse else ''),
                worse,
                window.record.stamp_ns(len(window.record) - 1),
            )
        ]

    def _compared(self, i: int) -> bool:
        """Whether a structure of no weight stays, as a reference for the others."""
        member = self._members[i]
        return member.before and not member.model.effects

    def _outdone(self, errors: Sequence[float], material: float) -> bool:
        """Drop the leading structure if it makes forecasts worse; return whether it was dropped.

        That is if they were worse than those of the best reference, by more than what matters, in
        enough successive windows; the reference takes its place.
        """
        leading = self._members[0]
        rivals = [
            (error, i)
            for i, (member, error) in enumerate(zip(self._members, errors, strict=True))
            if i > 0 and member.before and np.isfinite(error)
        ]
        for member in self._members[1:]:
            member.worse = 0
        if not leading.model.effects or not rivals or not np.isfinite(errors[0]):
            return False
        least, best = min(rivals)
        leading.worse = leading.worse + 1 if errors[0] > least + material**2 else 0
        lasts = max(structures.WORSE, math.ceil(structures.WORSE_SECONDS / self.settings.hop))
        if leading.worse < lasts:
            return False
        self._log_prior[best] = max(self._log_prior[0], self._log_prior[best])
        self._evidence[best] = max(self._evidence[0], self._evidence[best])
        self._log_prior[0] = -np.inf
        return True

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

        Of a schedule, those before it are begun with here: their windows failed, and are not in
        the bag.
        """
        if self.schedule is None:
            return self._pending
        due = [model for number, model in self.schedule.models if number <= window.number]
        if len(due) == self._applied:
            return None
        for passed in due[self._applied : -1]:
            self._begin(Proposal.of(passed))
        self._applied = len(due)
        return Proposal.of(due[-1])


def _learned(member: _Member, found: WindowResult | WindowFit) -> list[Contradicted]:
    """Keep the results of a structure's window; return alarms that it contradicts its prior."""
    member.waited = 0
    if found.failure:
        return []
    if found.archive is not None:
        member.archive, member.epoch = found.archive, found.window.epoch
    if found.frozen is not None:
        member.frozen = replace(found.frozen, beside=())
    return member.knowledge.learn(found.window, found.learned, found.conflict)


def _box(model: ModelChoice) -> dict[str, tuple[float, float]]:
    """Return the bounds of each parameter, in whatever order they come."""
    pairs = zip(model.lower, model.upper, strict=True)
    return dict(zip(model.names, pairs, strict=True))


def _key(window: Window) -> tuple[int, int]:
    return window.record.first_index, window.record.start_ns
