"""Estimator and live diagnosis joined as the nodes join them, in the stream's own time."""

from __future__ import annotations

import time
from dataclasses import dataclass, field

import numpy as np

from actuator_glue.api.diagnosis import diagnose
from actuator_glue.api.live import EFFORT, concluded, given
from actuator_glue.diagnosis.remembered import Remembered
from actuator_glue.inference.carried import Carried
from actuator_glue.inference.choice import choose_model
from actuator_glue.online import when_to_diagnose as live
from actuator_glue.online.collect import Collector
from actuator_glue.online.estimator import Estimator
from actuator_glue.online.job import WindowResult, run
from actuator_glue.online.knowledge import Known
from actuator_glue.online.memory import Memory, looked_at
from actuator_glue.online.playback import sample_beside, stream
from actuator_glue.online.settings import EstimatorSettings
from actuator_glue.online.stream import Contradicted, Event
from actuator_glue.online.trust import Contradiction
from actuator_glue.records import Record
from actuator_glue.sample_block import Block
from actuator_glue.setups import StreamSetup

SETTINGS = EstimatorSettings(prior='sequential', evaluations=4000, start_evaluations=16_000)
KEPT = 180.0  # s
BLOCK = 0.5  # s


@dataclass
class Chain:
    """A run: every window's result, and what was done when.

    Attributes:
        results: of all windows.
        said: time [s] and text of what was told or done.
        broke: when the coverage broke first [s]; NaN for never.
        added: when an effect was carried first [s].
        removed: when one was taken out again [s].
        proposals: time and effects of each proposal's structures.
        looks: processor time of each diagnosis [s].
        material: smallest forecast error that matters, by window [m].
    """

    results: list[WindowResult] = field(default_factory=list)
    said: list[tuple[float, str]] = field(default_factory=list)
    broke: float = np.nan
    added: float = np.nan
    removed: list[float] = field(default_factory=list)
    proposals: list[tuple[float, tuple[tuple[str, ...], ...]]] = field(default_factory=list)
    looks: list[float] = field(default_factory=list)
    material: list[float] = field(default_factory=list)


def chain(
    record: Record,
    carried: Carried | None,
    wanted: live.LiveSettings,
    settings: EstimatorSettings = SETTINGS,
    seed: int = 1,
) -> Chain:
    """Run a stream through estimator and diagnosis.

    Windows have all the time that they want; while a diagnosis computes the stream goes on, for as
    long as that took of a processor.

    Args:
        record: what is streamed.
        carried: what a calibration knows; None for nothing.
        wanted: when to diagnose.
        settings: of the estimator.
        seed: of the diagnoses.
    """
    loop = _Loop(carried, wanted, settings, seed)
    for item in stream(record, round(BLOCK * record.rate)):
        if isinstance(item, StreamSetup):
            loop.estimator.setup(item)
            loop.collector.setup(item)
        elif isinstance(item, Block):
            loop.push(item)
    return loop.out


class _Loop:
    """Both state machines and what passes between them; arguments as `chain`."""

    def __init__(
        self,
        carried: Carried | None,
        wanted: live.LiveSettings,
        settings: EstimatorSettings,
        seed: int,
    ) -> None:
        self.out = Chain()
        self.estimator = Estimator(settings, choose_model(), carried=carried)
        self.collector = Collector(KEPT)
        self._settings, self._seed = settings, seed
        self._state, self._memory = live.init(wanted), Memory()
        self._remembered = Remembered()
        self._memory.setup(settings, carried)
        self._waiting: list[tuple[float, live.Concluded]] = []
        self._contradiction = Contradiction()
        self._now = 0.0

    def push(self, block: Block) -> None:
        """Take a block, and do all that follows."""
        self._now = (block.index + len(block)) * block.period
        self._memory.began(block.stamp_ns)
        self.estimator.push(block)
        self.collector.push(block)
        while self._waiting and self._waiting[0][0] <= self._now:
            self._take(self._waiting.pop(0)[1])
        self._take(live.Received(self.collector.received))
        while (job := self.estimator.next_job()) is not None:
            result = run(job)
            told = self.estimator.finish(result)
            sample_beside(self.estimator)
            if job.proposal is not None:
                self._take(live.Carries(job.window.number))
            if not result.failure:
                self._estimated(result, told)

    def _estimated(self, result: WindowResult, told: list[Event]) -> None:
        self.out.results.append(result)
        self.out.material.append(self.estimator.proposal.material)
        self.out.said += [(self._now, event.message) for event in told]
        for prediction in result.scored:
            if prediction.kind == 'noise' and prediction.coverage is not None:
                coverage, number = float(prediction.coverage[-1]), prediction.number
                held = float(prediction.width[-1]), float(prediction.band.levels[-1])
                self._take(live.Judged.of(coverage, number, prediction.rms_error, *held))
        weights = tuple((frozenset(m.effects), w) for m, w in self.estimator.weights)
        alarms = [event for event in told if isinstance(event, Contradicted)]
        self._contradiction.take(result, alarms)
        contradicted = self._contradiction.since_ns is not None
        contradicts = self._contradiction.lasted(result.window)
        self._take(live.Estimated(contradicted, weights, contradicts))
        if self._state.trusted:
            self._memory.learn(_known(result, self._settings), self.collector.first_ns)

    def _take(self, given: live.Input) -> None:
        self._state, actions = live.step(self._state, given)
        out, now = self.out, self._now
        for action in actions:
            if isinstance(action, live.Look):
                out.said.append((now, f'looks: {action.reason}'))
                found = self._look(action.since)
                self._waiting.append((now + out.looks[-1], found))
            elif isinstance(action, live.Carry):
                self.estimator.set_model(action.proposal)
                carried = tuple(one.model.effects for one in action.proposal.structures)
                out.said.append((now, f'carries {action.proposal.described()}'))
                out.proposals.append((now, carried))
                if carried[0] and np.isnan(out.added):
                    out.added = now
                if action.taken_out:
                    out.removed.append(now)
            else:
                if action.kind == 'coverage' and np.isnan(out.broke):
                    out.broke = now
                out.said.append((now, action.message))

    def _look(self, since: float) -> live.Concluded:
        records, known = looked_at(self.collector, self._memory, since)
        began = time.process_time()
        found = diagnose(
            records,
            seed=self._seed,
            jobs=1,
            effort=EFFORT,
            prior=given(known),
            remembered=self._remembered,
        )
        self.out.looks.append(time.process_time() - began)
        self.out.said.append((self._now, found.summary()))
        return concluded(found, records)


def _known(result: WindowResult, settings: EstimatorSettings) -> Known:
    """Return a window's posterior as its PosteriorDraws tells it."""
    record = result.window.record
    assert result.draws is not None
    start = record.stamp_ns(round(settings.settle / record.period))
    last = record.stamp_ns(len(record) - 1)
    middle = (start + last) // 2
    there = Carried(result.model.names, result.draws).later((middle - record.start_ns) * 1e-9)
    return Known(there, middle, last)
