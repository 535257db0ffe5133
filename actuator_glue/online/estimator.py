"""The online estimator as a state machine: samples in, jobs out, results back in."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.inference.carried import Carried
from actuator_glue.inference.choice import ModelChoice
from actuator_glue.online.fitting import starting_points
from actuator_glue.online.forecast import FrozenPosterior
from actuator_glue.online.job import WindowResult
from actuator_glue.online.knowledge import Knowledge
from actuator_glue.online.sampling import Job, WindowFit
from actuator_glue.online.settings import EstimatorSettings
from actuator_glue.online.stream import Dropped, Event, Failed, Preview, Rejected, Window
from actuator_glue.online.windows import SlidingWindows, Tally
from actuator_glue.records import MAX_DISPLACEMENT, Array
from actuator_glue.sample_block import Block
from actuator_glue.setups import StreamSetup

# Forecasts wait for their samples for two or three hops; more only when windows are dropped.
MAX_FROZEN = 8
# After a stall of the whole computer several hops arrive at once.
MAX_WAITING = 4


@dataclass(frozen=True, slots=True)
class Schedule:
    """What a live run did, for a replay to repeat it.

    Attributes:
        done: number and evaluations of each window that gave a posterior, by the running index
            and the acquisition time [ns] of its first sample; all others were dropped.
        models: model from each window number on, ascending.
    """

    done: Mapping[tuple[int, int], tuple[int, int]]
    models: tuple[tuple[int, ModelChoice], ...] = ()


@dataclass(slots=True)
class _Memory:
    """What is kept from the last result."""

    archive: Array | None = None
    model: ModelChoice | None = None
    epoch: int = -1
    frozen: list[FrozenPosterior] = field(default_factory=list)


class Estimator:
    """Windows, warm start and forecasts; knows no clock, no process and no ROS.

    `push` what arrives, ask `next_job`, compute it wherever you like with `job.run`, hand the
    result to `finish`. One job is out at a time. The results depend on the samples, the settings
    and which windows were dropped or stopped early: a `Schedule` repeats those.

    Args:
        settings: settings; they do not change.
        model: model to fit.
        live: a few windows wait, so that a slow computer drops windows instead of falling
            behind; otherwise every window waits its turn.
        schedule: repeats a live run.
        carried: draws of an earlier calibration, for the priors that start from one.
    """

    def __init__(
        self,
        settings: EstimatorSettings,
        model: ModelChoice,
        *,
        live: bool = False,
        schedule: Schedule | None = None,
        carried: Carried | None = None,
    ) -> None:
        self.settings = settings
        self.model = model
        self.live = live
        self.schedule = schedule
        self.running: Job | None = None
        self._windows = SlidingWindows(settings)
        self._waiting: list[Window] = []
        self._memory = _Memory()
        self._knowledge = Knowledge(settings, carried)
        self._ahead = Ahead()

    @property
    def tally(self) -> Tally:
        """Counts since the start."""
        return self._windows.tally

    @property
    def test(self) -> StreamSetup | None:
        """The test set-up that holds."""
        return self._windows.current

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
            self._knowledge.formed(window)
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

    def set_model(self, model: ModelChoice) -> None:
        """Go on with another model from the next job on."""
        self.model = model

    def drop(self, late: Callable[[Window], bool]) -> list[Event]:
        """Drop windows that wait and for which it is too late; the newest is always wanted."""
        events: list[Event] = []
        while len(self._waiting) > 1 and late(self._waiting[0]):
            events.append(self._drop())
        return events

    def next_job(self) -> Job | None:
        """Return the next job, or None where there is nothing to do or one is running."""
        if self.running is not None or not self._waiting:
            return None
        window = self._waiting.pop(0)
        memory, model = self._memory, self._model_for(window)
        record, prior = window.record, self._knowledge.prior(window, model.effects)
        archive, afresh = None, True
        if (
            memory.archive is not None
            and memory.model is not None
            and (memory.epoch == window.epoch)
        ):
            seed = (self.settings.seed, record.first_index, 2)
            afresh = model != memory.model
            known, points = memory.model.names, memory.archive
            if afresh and prior is not None:
                # Where another model ended is further away than what was known before either.
                known = prior.names
                points = prior.points(len(points), np.random.default_rng((*seed, 1)))
            archive = starting_points(model, known, points, seed)
        job = Job(
            window=window,
            settings=self.settings,
            model=model,
            archive=archive,
            afresh=afresh,
            stop_at=None if self.schedule is None else self.schedule.done[_key(window)][1],
            frozen=self._judged(window),
            prior=prior,
        )
        ahead = self._ahead.between(window.end, job.forecast[1], record.period)
        self.running = replace(job, ahead=ahead)
        return self.running

    def finish(self, result: WindowResult | WindowFit) -> list[Event]:
        """Take the result of the running job, or its first part, all that the next one needs."""
        self.running = None
        window, memory = result.window, self._memory
        if result.failure:
            # A replay leaves such windows out: nothing may depend on them.
            return [Failed(window.number, window.record.first_index, result.failure)]
        if result.archive is not None:
            memory.archive, memory.model, memory.epoch = result.archive, result.model, window.epoch
        memory.frozen = [
            f for f in memory.frozen if f.segment == window.segment and f.stop > window.end
        ]
        if result.frozen is not None:
            memory.frozen.append(result.frozen)
            del memory.frozen[:-MAX_FROZEN]
        return [*self._knowledge.learn(window, result.learned, result.conflict)]

    def abandon(self, reason: str) -> list[Event]:
        """Give up the running job, whose process has died."""
        job, self.running = self.running, None
        if job is None:
            return []
        return [Failed(job.window.number, job.window.record.first_index, reason)]

    def _drop(self) -> Dropped:
        old = self._waiting.pop(0)
        return Dropped(old.number, old.record.first_index)

    def _judged(self, window: Window) -> tuple[FrozenPosterior, ...]:
        """Return the earlier posteriors whose forecasts a window's samples judge."""
        first = window.recent.first_index
        # All commands since their windows' ends are known.
        return tuple(
            f
            for f in self._memory.frozen
            if f.segment == window.segment and first <= f.end and f.stop <= window.end
        )

    def _planned(self, window: Window) -> Window | None:
        """Return a window as the schedule numbers it; None where the live run dropped it."""
        if self.schedule is None:
            return window
        done = self.schedule.done.get(_key(window))
        return None if done is None else replace(window, number=done[0])

    def _model_for(self, window: Window) -> ModelChoice:
        if self.schedule is not None:
            for number, model in self.schedule.models:
                if number <= window.number:
                    self.model = model
        return self.model


def _key(window: Window) -> tuple[int, int]:
    return window.record.first_index, window.record.start_ns


class Ahead:
    """Commands that are known before they are acted on; bounded."""

    def __init__(self, limit: int = 1_000_000) -> None:
        self._limit = limit
        self._start = 0
        self._period = 0.0
        self._command: Array = np.empty(0)

    def take(self, preview: Preview) -> None:
        """Join a preview to what is known; one that does not join replaces it.

        Raises:
            InputError: NaN, absurd values, or far too many samples.
        """
        command = np.asarray(preview.command, dtype=np.float64)
        where = f'command preview at sample {preview.index}'
        if not len(command) or len(command) > self._limit:
            raise InputError(f'{where}: {len(command)} samples; 1 to {self._limit} can be used')
        if not np.abs(command).max() <= MAX_DISPLACEMENT:
            raise InputError(f'{where}: NaN, or a displacement beyond {MAX_DISPLACEMENT:g} m')
        stop = self._start + len(self._command)
        if preview.period == self._period and self._start <= preview.index <= stop:
            command = np.concatenate([self._command[: preview.index - self._start], command])
            self._command = command[-self._limit :]
            self._start += len(command) - len(self._command)
        else:
            self._start, self._period, self._command = preview.index, preview.period, command

    def forget(self, index: int) -> None:
        """Forget commands before a sample."""
        gone = min(max(0, index - self._start), len(self._command))
        self._command = self._command[gone:]
        self._start += gone

    def between(self, start: int, stop: int, period: float) -> Array | None:
        """Return the commands of samples start:stop; None where not all of them are known."""
        if self._period == 0.0 or abs(period / self._period - 1.0) > 1e-4:
            return None
        if not self._start <= start <= stop <= self._start + len(self._command):
            return None
        return self._command[start - self._start : stop - self._start]
