"""The online estimator as a node: samples in, posterior moments and prediction bands out."""

from __future__ import annotations

import statistics
import sys
import time
from collections import deque
from collections.abc import Mapping
from typing import Any

from actuator_glue_msgs.srv import SetModel

from actuator_glue import sample_block
from actuator_glue.errors import InputError
from actuator_glue.inference.choice import choose_model
from actuator_glue.io.calendar_time import calendar_time
from actuator_glue.nodes import configuration, own_effects, spin, topics
from actuator_glue.nodes.estimator_worker import Afterwards, compute, compute_beside, warm_up
from actuator_glue.nodes.health import ERROR, Rate
from actuator_glue.nodes.latched import Latched, of_one_numbering
from actuator_glue.nodes.messages import publish
from actuator_glue.nodes.now import now_ns
from actuator_glue.nodes.silence import Silence
from actuator_glue.nodes.tracking import publish_tracking
from actuator_glue.nodes.working import WorkingNode
from actuator_glue.online import conversion
from actuator_glue.online.channels import ChannelFault
from actuator_glue.online.estimator import Estimator
from actuator_glue.online.fitting import identifiable
from actuator_glue.online.job import WindowResult
from actuator_glue.online.stream import (
    Contradicted,
    Dropped,
    Event,
    Failed,
    Rejected,
    Restarted,
    Reweighed,
    Window,
    structure_name,
)
from actuator_glue.online.structures import Proposal
from actuator_glue.online.trust import (
    Contradiction,
    natural_frequency,
    sampled_too_slowly,
    trust,
)
from actuator_glue.online.window_posterior import Job
from actuator_glue.online.windows import WrongRate
from actuator_glue.setups import from_message
from actuator_glue.workers.worker import DIED, DONE, FAILED, PROGRESS, Answer, Worker

# Number of last windows of which most have to converge.
JUDGED = 10
# Niceness of the process that samples less likely structures, which may wait.
NICE = 10


class EstimatorNode(WorkingNode):
    """Feeds the estimator's state machine and publishes what it finds."""

    def __init__(self) -> None:
        super().__init__('estimator', configuration.SPECS)

    def check(self, values: Mapping[str, Any]) -> None:
        """Refuse settings that contradict each other."""
        configuration.settings(values)
        configuration.tracking_frequencies(values)
        own_effects.load(values)
        choose_model(configuration.effects(values))
        configuration.carried(values)

    def do_configure(self) -> None:
        """Start the worker process, which compiles while nothing depends on it yet."""
        values = self.parameters.values()
        self.settings = configuration.settings(values)
        self._carried = configuration.carried(values)
        self.employ(warm_up)
        self._beside: Worker | None = None
        self._out = {topic: self.publisher(topic) for topic in topics.ESTIMATED}
        self._frequencies = configuration.tracking_frequencies(values)
        service = self.create_service(SetModel, '~/set_model', self._set_model)
        self.at_cleanup(lambda: self.destroy_service(service))

    def do_activate(self) -> None:
        """Begin with an empty window."""
        model = choose_model(configuration.effects(self.parameters.values()))
        self.estimator = Estimator(self.settings, model, live=True, carried=self._carried)
        self.contradictions = 0
        self._announced: Proposal | None = None
        self._arrival: dict[int, float] = {}
        self.samples, self.windows = Rate(), Rate()
        self.dropped = self.late = self.failed = 0
        self.compute: deque[float] = deque(maxlen=200)
        self.latency: deque[float] = deque(maxlen=200)
        self.last: WindowResult | None = None
        self.contradiction, self.channels = Contradiction(), ChannelFault()
        self.silence = Silence(time.monotonic())
        self.judged: deque[bool] = deque(maxlen=JUDGED)
        # Before the first samples: what they will be estimated with is known from the start.
        self._announce(None)
        self.listen_when_ready()

    def listen(self) -> None:
        """Subscribe: set-ups first, then the samples that they are for."""
        self.silence = Silence(time.monotonic())
        self._setups = Latched(self, topics.TEST_SETUP, self._setup, of_one_numbering)
        self.subscribe(topics.PREVIEW, self._preview)
        self.subscribe(topics.SAMPLES, self._block)

    def do_deactivate(self) -> None:
        """Give up the running window."""
        if self.estimator.running is not None and not self.finished:
            self.give_up()
        if self._beside is not None:
            self.dismiss(self._beside)
            self._beside = None

    def clock_jumped(self) -> None:
        """Nothing depends on the node's clock: windows follow the stamps of the samples."""

    # Samples in.

    def _setup(self, message: Any) -> None:
        self._tell(self.estimator.setup(from_message(message)))

    def _preview(self, message: Any) -> None:
        self._tell(self.estimator.preview(conversion.preview(message)))

    def _block(self, message: Any) -> None:
        self._setups.settle()
        block = sample_block.from_message(message)
        self.samples.add(len(block))
        self.silence.heard(time.monotonic())
        if block.index and not self.estimator.tally.blocks:
            self.complain(
                'start', f'begins anew at sample {block.index}: nothing is known of those before'
            )
        self._tell(self.estimator.push(block))
        self._say_unused()
        self._next(time.monotonic())

    def _tell(self, events: list[Event]) -> None:
        for event in events:
            if isinstance(event, WrongRate):
                self.complain('sample rate', event.message, ERROR)
            elif isinstance(event, Rejected):
                self.complain('bad input', event.message)
            elif isinstance(event, Dropped):
                self.dropped += 1
                why = (
                    'the worker is still compiling' if self.compiling else 'computing took longer'
                )
                self.complain('deadline', f'window {event.number} dropped: {why}')
            elif isinstance(event, Failed):
                self.failed += 1
                self.complain('window', f'window {event.number}: {event.message}')
            elif isinstance(event, Contradicted):
                self.contradictions += 1
                self.complain('prior', event.message)
            elif isinstance(event, Reweighed) and event.worse:
                self.complain('taken out', f'{event.message} ({_date(event.stamp_ns)})')
            elif isinstance(event, Reweighed):
                self.get_logger().info(event.message)
            elif isinstance(event, Restarted) and event.reason == 'setup':
                self.get_logger().info(event.message)
                self._say_identifiable()
            elif isinstance(event, Restarted):
                self.complain(event.reason, event.message)
            if isinstance(event, Restarted) and event.reason in ('setup', 'stream'):
                self.channels = ChannelFault()  # channels of another sender, maybe

    def _say_unused(self) -> None:
        """Complain while the set-up that governs the present samples lets none be used."""
        if reason := self.estimator.unused:
            self.complain('test set-up', f'{reason}: nothing is estimated')

    def _say_identifiable(self) -> None:
        test = self.estimator.test
        if test is not None and test.stiffness is not None:
            text = identifiable(test.stiffness)
            self.health.values['identifiable'] = text
            self.get_logger().info(text)

    # Jobs out, results back.

    def _next(self, now: float) -> None:
        for window in self.estimator.waiting:
            self._arrival.setdefault(window.number, now)
        self._tell(self.estimator.drop(lambda window: self._too_late(window, now)))
        job = None if self.compiling else self.estimator.next_job()
        if job is None:
            return
        self._announce(job)
        arrival = self._arrival.get(job.window.number, now)
        self._arrival = {n: t for n, t in self._arrival.items() if n > job.window.number}
        self._started = arrival
        self.worker.submit(compute, job, arrival + job.seconds, self._frequencies)

    def _too_late(self, window: Window, now: float) -> bool:
        """Whether a window could not be published in time any more, or only cut short."""
        takes = statistics.median(self.compute) if self.compute else 0.0
        return now + 2.0 * takes > self._arrival[window.number] + self.settings.time_budget

    def answered(self, answer: Answer) -> None:
        """Take the result of a window, its tracking numbers afterwards, or that there is none."""
        if not self.active:
            return
        if answer.kind in (DIED, FAILED):
            self._tell(self.estimator.abandon(answer.payload))
        if answer.kind == DIED:
            self.get_logger().info('the estimate goes on from its last window')
        if answer.kind == FAILED:
            self.complain('internal error', str(answer.payload), ERROR)
        elif answer.kind == PROGRESS and self.estimator.running is not None:
            self._finish(answer.payload, answer.seconds)
        elif answer.kind == DONE:
            self._take_afterwards(answer.payload)
        self._next(time.monotonic())

    def _finish(self, result: WindowResult, seconds: float) -> None:
        events = self.estimator.finish(result)
        self._tell(events)
        self._sample_beside()
        if result.failure:
            return
        self.contradiction.take(result, [e for e in events if isinstance(e, Contradicted)])
        self.last = result
        self.judged.append(result.converged)
        self.windows.add()
        actuator = result.window.record.actuator
        head, fields = conversion.posterior(result, seconds)
        believed = trust(result, self.contradiction, self.channels)
        publish(self._out[topics.POSTERIOR], head, fields | believed)
        publish(self._out[topics.DRAWS], *conversion.draws(result))
        for prediction in (*result.scored, *result.forecast):
            publish(self._out[topics.BAND], *conversion.prediction(prediction, actuator))
        publish(self._out[topics.RESPONSE], *conversion.response(result))
        latency = time.monotonic() - self._started
        self.compute.append(seconds)
        self.latency.append(latency)
        if latency > self.settings.time_budget:
            self.late += 1
            self.complain(
                'deadline',
                f'window {result.window.number} took {latency:.3f} s from its last sample, '
                f'budget {self.settings.time_budget:g} s',
            )

    def _take_afterwards(self, found: Afterwards) -> None:
        self.channels.take(found.fault)
        if found.tracked is not None:
            for complaint in publish_tracking(self._out, found.tracked, self._frequencies):
                self.complain('tracking', complaint)

    def _sample_beside(self) -> None:
        """Have another structure sampled by a process that no window waits for."""
        job = self.estimator.rival_job()
        if job is None:
            return
        if self._beside is None:
            # Only an estimator that carries several structures has this process.
            self._beside = self.colleague(self._sampled_beside, nice=NICE)
        self._beside.submit(compute_beside, job)

    def _sampled_beside(self, answer: Answer) -> None:
        """Take what another structure's window gave."""
        if not self.active or self._beside is None:
            return
        if answer.kind == DONE:
            self.estimator.finish_rival(answer.payload)
            return
        if answer.kind == FAILED:
            self.complain('internal error', str(answer.payload), ERROR)
        self.estimator.abandon_rival()
        self._sample_beside()

    def _announce(self, job: Job | None) -> None:
        """Publish what windows are estimated with, once per change."""
        proposal = self.estimator.proposal if job is None else job.proposal
        if proposal is None or proposal is self._announced:
            return
        self._announced = proposal
        number, index, stamp, actuator = 0, 0, now_ns(self.get_clock()), ''
        if job is not None:
            record = job.window.record
            number, index = job.window.number, record.first_index
            stamp, actuator = record.start_ns, record.actuator
            self.get_logger().info(f'{actuator}, window {number} on: {proposal.described()}')
        fields = conversion.estimator_setup(self.settings, proposal, number, index, self._carried)
        publish(self._out[topics.ESTIMATOR_SETUP], conversion.Head(stamp, actuator), fields)

    def _set_model(self, request: Any, response: Any) -> Any:
        try:
            if not self.active:
                raise InputError('the estimator is not active')
            proposal = configuration.requested(request)
            self.estimator.set_model(proposal)
        except InputError as error:
            response.success, response.message = False, str(error)
            self.get_logger().warning(f'set_model refused: {error}')
            return response
        response.success = True
        response.message = f'from the next window on: {proposal.described()}'
        self.get_logger().info(response.message)
        return response

    def do_report(self) -> None:
        """Rate, gaps, dropped windows, R-hat, compute time."""
        super().do_report()
        if not hasattr(self, 'estimator'):
            return
        now, tally = time.monotonic(), self.estimator.tally
        if self.active:
            self._doubt(now)
        values: dict[str, Any] = {
            'sample rate (1/s)': self.samples.per_second(now),
            'window rate (1/s)': self.windows.per_second(now),
            'samples': tally.samples,
            'samples lost': tally.lost,
            'gaps': tally.gaps,
            'restarts': tally.restarts,
            'blocks rejected': tally.rejected,
            'windows': self.windows.count,
            'windows dropped': self.dropped,
            'windows failed': self.failed,
            'deadlines missed': self.late + self.dropped,
            'model': ', '.join(self.estimator.model.effects) or 'Eq. (2)',
            'explanations': ', '.join(
                f'{structure_name(model.effects)} {weight:.0%}'
                for model, weight in self.estimator.weights
            ),
            'prior': self.settings.prior,
            'prior contradicted': self.contradictions,
        }
        if self.last is not None and self.last.conflict is not None:
            values['prior p-value'] = self.last.conflict.p_value
        if self.last is not None and self.last.rhat is not None:
            latency = sorted(self.latency)
            values |= {
                'R-hat': float(self.last.rhat.max()),
                'converged': self.last.converged,
                'stopped early': self.last.stopped_early,
                'evaluations': self.last.evaluations,
                'compute time (s)': sum(self.compute) / len(self.compute),
                'latency median (s)': latency[len(latency) // 2],
                'latency p99 (s)': latency[int(0.99 * (len(latency) - 1))],
                'rms error (m)': self.last.rms_error,
                'prior dominated': ', '.join(
                    name
                    for name, flag in zip(
                        self.last.model.names, self.last.prior_dominated, strict=True
                    )
                    if flag
                )
                or 'none',
            }
        self.health.values.update(values)

    def _doubt(self, now: float) -> None:
        """Report, while it lasts, what speaks against the posteriors, or that none come."""
        if not self.compiling:
            self.silence.tell(self, topics.SAMPLES.name, now)
        self._say_unused()
        self.health.values['converged windows'] = f'{sum(self.judged)} of {len(self.judged)}'
        if len(self.judged) == JUDGED and 2 * sum(self.judged) < JUDGED:
            self.complain('sampling', f'most of the last {JUDGED} windows have not converged')
        if self.channels.fault:
            text = f'{self.channels.fault}; until then posteriors say nothing of the actuator'
            self.complain('channels', text)
        if self.last is None:
            return
        since, window = self.contradiction.since_ns, self.last.window
        if since is not None:
            self.health.values['prior contradicted for (s)'] = self.contradiction.lasted(window)
            self.complain(
                'contradiction', f'samples contradict what was known, since {_date(since)}'
            )
        else:
            self.health.values.pop('prior contradicted for (s)', None)
        if sampled_too_slowly(self.last):
            natural, rate = natural_frequency(self.last), window.record.rate
            self.complain(
                'doubt',
                f'the loop is faster than {rate:g} Hz can show (by the posterior its natural '
                f'frequency is {natural:.2g} Hz): parameters and intervals say nothing; '
                'sample ten times as fast',
            )


def _date(stamp_ns: int) -> str:
    moment = calendar_time(stamp_ns)
    if moment is None:
        return f'{stamp_ns * 1e-9:.3f} s of the stream'
    return moment.strftime('%Y-%m-%d %H:%M:%S UTC')


def main(args: list[str] | None = None) -> int:
    """Run the node."""
    return spin.main(EstimatorNode, args)


if __name__ == '__main__':
    sys.exit(main())
