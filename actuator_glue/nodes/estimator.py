"""The online estimator as a node: samples in, posterior moments and prediction bands out."""

from __future__ import annotations

import statistics
import sys
import time
from collections import deque
from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from actuator_glue_msgs.srv import SetModel

from actuator_glue.errors import InputError
from actuator_glue.inference.choice import ModelChoice, choose_model
from actuator_glue.nodes import base, spin, topics
from actuator_glue.nodes.estimating import compute, warm_up
from actuator_glue.nodes.health import ERROR, Rate
from actuator_glue.nodes.messages import publish
from actuator_glue.nodes.parameters import Spec
from actuator_glue.online import wire
from actuator_glue.online.estimator import Estimator
from actuator_glue.online.fitting import identifiable
from actuator_glue.online.job import WindowResult
from actuator_glue.online.sampling import Job
from actuator_glue.online.settings import LIMITS, EstimatorSettings
from actuator_glue.online.stream import Dropped, Event, Failed, Rejected, Restarted, Window
from actuator_glue.workers.worker import DIED, FAILED, Answer, Worker


def _specs() -> list[Spec]:
    """Parameters from the settings' own table, so that neither can drift from the other."""
    defaults = EstimatorSettings()
    specs = []
    for field in fields(EstimatorSettings):
        limit = LIMITS.get(field.name)
        if limit is None:
            continue
        value = getattr(defaults, field.name)
        specs.append(
            Spec(field.name, value, limit.meaning, limit.unit, limit.lower, limit.upper, True)
        )
    return specs


SPECS = (
    *_specs(),
    Spec('likelihood', 'glue', 'likelihood', read_only=True, choices=('glue', 'gaussian')),
    Spec('levels', list(EstimatorSettings().levels), 'probability of each band', read_only=True),
    Spec('effects', [''], 'effects of the catalogue beyond Eq. (2)', read_only=True),
)


class EstimatorNode(base.SuiteNode):
    """Feeds the estimator's state machine and publishes what it finds."""

    def __init__(self) -> None:
        super().__init__('estimator', SPECS)

    def check(self, values: Mapping[str, Any]) -> None:
        """Refuse settings that contradict each other."""
        _settings(values)
        choose_model(_effects(values))

    def do_configure(self) -> None:
        """Start the worker process, which compiles while nothing depends on it yet."""
        values = self.parameters.values()
        self.settings = _settings(values)
        self._answers: deque[Answer] = deque()
        self._guard = self.create_guard_condition(self.guarded(self._take_answers))
        self.worker = Worker(self._answered, warm_up)
        self._out = {
            topic: self.publisher(topic)
            for topic in (topics.POSTERIOR, topics.BAND, topics.RESPONSE, topics.ESTIMATOR_SETUP)
        }
        self._service = self.create_service(SetModel, '~/set_model', self._set_model)

    def do_activate(self) -> None:
        """Begin with an empty window."""
        model = choose_model(_effects(self.parameters.values()))
        self.estimator = Estimator(self.settings, model, live=True)
        self._announced: ModelChoice | None = None
        self._arrival: dict[int, float] = {}
        self.samples, self.windows = Rate(), Rate()
        self.dropped = self.late = self.failed = 0
        self.compute: deque[float] = deque(maxlen=200)
        self.latency: deque[float] = deque(maxlen=200)
        self.last: WindowResult | None = None
        # Before the first samples: what they will be estimated with is known from the start.
        self._announce(None)
        self.subscribe(topics.TEST_SETUP, self._setup)
        self.subscribe(topics.PREVIEW, self._preview)
        self.subscribe(topics.SAMPLES, self._block)

    def do_deactivate(self) -> None:
        """Give up the running window."""
        self._answers.clear()
        if self.estimator.running is not None and not self.finished:
            self.worker.restart()

    def do_cleanup(self) -> None:
        """End the worker."""
        self.worker.close()
        self.destroy_service(self._service)
        self.destroy_guard_condition(self._guard)

    def clock_jumped(self) -> None:
        """Nothing depends on the node's clock: windows follow the stamps of the samples."""

    # Samples in.

    def _setup(self, message: Any) -> None:
        setup = wire.setup(message)
        self._tell(self.estimator.setup(setup))
        if setup.stiffness is None:
            self.complain(
                'test set-up',
                f'the specimen stiffness of {setup.actuator!r} is not known: nothing is estimated',
            )

    def _preview(self, message: Any) -> None:
        self._tell(self.estimator.preview(wire.preview(message)))

    def _block(self, message: Any) -> None:
        block = wire.block(message)
        self.samples.add(len(block))
        self._tell(self.estimator.push(block))
        if self.estimator.test is None:
            self.complain(
                'test set-up', f'samples arrive, but nothing on {topics.TEST_SETUP.name} yet'
            )
        self._next(time.monotonic())

    def _tell(self, events: list[Event]) -> None:
        for event in events:
            if isinstance(event, Rejected):
                self.complain('bad input', event.message)
            elif isinstance(event, Dropped):
                self.dropped += 1
                self.complain('deadline', f'window {event.number} dropped: computing took longer')
            elif isinstance(event, Failed):
                self.failed += 1
                self.complain('window', f'window {event.number}: {event.message}')
            elif isinstance(event, Restarted) and event.reason == 'setup':
                self.get_logger().info(event.message)
                self._say_identifiable()
            elif isinstance(event, Restarted):
                self.complain(event.reason, event.message)

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
        job = self.estimator.next_job() if self.worker.ready.is_set() else None
        if job is None:
            return
        self._announce(job)
        arrival = self._arrival.get(job.window.number, now)
        self._arrival = {n: t for n, t in self._arrival.items() if n > job.window.number}
        self._started = arrival
        self.worker.submit(compute, job, arrival + self.settings.time_budget)

    def _too_late(self, window: Window, now: float) -> bool:
        """Whether a window could not be published in time any more, or only cut short."""
        takes = statistics.median(self.compute) if self.compute else 0.0
        return now + 2.0 * takes > self._arrival[window.number] + self.settings.time_budget

    def _answered(self, answer: Answer) -> None:
        """Called from the listening thread: hand over to the executor."""
        self._answers.append(answer)
        self._guard.trigger()

    def _take_answers(self) -> None:
        while self._answers:
            answer = self._answers.popleft()
            if not self.active:
                continue
            if answer.kind == DIED:
                self._tell(self.estimator.abandon(answer.payload))
                self.complain('worker', f'{answer.payload}; starting another', ERROR)
                self.worker.restart()
            elif answer.kind == FAILED:
                self._tell(self.estimator.abandon(answer.payload))
                self.complain('internal error', str(answer.payload), ERROR)
            elif self.estimator.running is not None:
                self._finish(answer.payload, answer.seconds)
        self._next(time.monotonic())

    def _finish(self, result: WindowResult, seconds: float) -> None:
        self._tell(self.estimator.finish(result))
        if result.failure:
            return
        self.last = result
        self.windows.add()
        actuator = result.window.record.actuator
        publish(self._out[topics.POSTERIOR], *wire.posterior(result, seconds))
        for prediction in (*result.scored, *result.forecast):
            publish(self._out[topics.BAND], *wire.prediction(prediction, actuator))
        publish(self._out[topics.RESPONSE], *wire.response(result))
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

    def _announce(self, job: Job | None) -> None:
        """Publish what windows are estimated with, once per change."""
        model = self.estimator.model if job is None else job.model
        if model == self._announced:
            return
        self._announced = model
        number, index, stamp, actuator = 0, 0, self.get_clock().now().nanoseconds, ''
        if job is not None:
            record = job.window.record
            number, index = job.window.number, record.first_index
            stamp, actuator = record.start_ns, record.actuator
        fields = wire.estimator_setup(self.settings, model, number, index)
        publish(self._out[topics.ESTIMATOR_SETUP], wire.Head(stamp, actuator), fields)

    def _set_model(self, request: Any, response: Any) -> Any:
        try:
            if not self.active:
                raise InputError('the estimator is not active')
            model = _requested(request)
            self.estimator.set_model(model)
        except InputError as error:
            response.success, response.message = False, str(error)
            self.get_logger().warning(f'set_model refused: {error}')
            return response
        effects = ', '.join(model.effects) or 'no effects'
        response.success = True
        response.message = f'from the next window on: Eq. (2) with {effects}'
        self.get_logger().info(response.message)
        return response

    def do_report(self) -> None:
        """Rate, gaps, dropped windows, R-hat, compute time."""
        if not hasattr(self, 'estimator'):
            return
        now, tally = time.monotonic(), self.estimator.tally
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
            'worker': 'ready' if self.worker.ready.is_set() else 'compiling',
        }
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


def _effects(values: Mapping[str, Any]) -> tuple[str, ...]:
    # ROS cannot declare an empty list of strings with its type, so an empty word stands for it.
    return tuple(name for name in values['effects'] if name)


def _settings(values: Mapping[str, Any]) -> EstimatorSettings:
    known = {f.name for f in fields(EstimatorSettings)}
    return EstimatorSettings.from_mapping({n: v for n, v in values.items() if n in known})


def _requested(request: Any) -> ModelChoice:
    names = list(request.parameter_names)
    lower, upper, start = list(request.lower), list(request.upper), list(request.start)
    if not len(names) == len(lower) == len(upper) or len(start) not in (0, len(names)):
        raise InputError(
            f'{len(names)} parameter names, {len(lower)} lower, {len(upper)} upper bounds and '
            f'{len(start)} starting values do not belong together'
        )
    bounds = {n: (lo, up) for n, lo, up in zip(names, lower, upper, strict=True)}
    places = dict(zip(names, start, strict=True)) if start else None
    return choose_model(tuple(request.effects), bounds, places)


def main(args: list[str] | None = None) -> int:
    """Run the node."""
    return spin.main(EstimatorNode, args)


if __name__ == '__main__':
    sys.exit(main())
