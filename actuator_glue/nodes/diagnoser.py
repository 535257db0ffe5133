"""What the model lacks: diagnosis on request, or by itself when something speaks for it.

What is due and what follows is decided in `online/when_to_diagnose.py`.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from actuator_glue_msgs.action import Diagnose
from actuator_glue_msgs.srv import SetModel
from rclpy.action import ActionServer, CancelResponse, GoalResponse

from actuator_glue import sample_block
from actuator_glue.diagnosis.remembered import Remembered
from actuator_glue.errors import InputError
from actuator_glue.nodes import diagnoser_worker, own_effects, spin, topics
from actuator_glue.nodes.explained import Explained
from actuator_glue.nodes.health import ERROR
from actuator_glue.nodes.latched import Latched, newest, of_one_numbering
from actuator_glue.nodes.messages import publish
from actuator_glue.nodes.now import now_ns
from actuator_glue.nodes.working import WorkingNode
from actuator_glue.online import conversion
from actuator_glue.online import when_to_diagnose as live
from actuator_glue.online.collect import Collector
from actuator_glue.online.memory import Memory, earliest, looked_at
from actuator_glue.online.stream import Event, Rejected, Restarted
from actuator_glue.online.structures import Proposal
from actuator_glue.setups import from_message
from actuator_glue.workers.worker import DIED, FAILED, PROGRESS, Answer

# How long the estimator may take to say whether it takes the augmented model [s].
ANSWER_SECONDS = 10.0


class DiagnoserNode(WorkingNode):
    """Collects samples, watches the coverage, and has a worker process diagnose."""

    def __init__(self) -> None:
        # The goal of the request that is being diagnosed; it leaves with the request's outcome.
        self._goal: Any = None
        self._request: diagnoser_worker.Request | None = None
        self._ended: tuple[diagnoser_worker.Outcome, Any] | None = None
        # What the estimator was asked, and until when its answer is waited for.
        self._swaps: dict[Any, float] = {}
        super().__init__('diagnoser', diagnoser_worker.SPECS)

    def check(self, values: Mapping[str, Any]) -> None:
        """Read the user's own effects."""
        own_effects.load(values)

    def do_configure(self) -> None:
        """Start the worker; offer the action."""
        self.employ(diagnoser_worker.warm_up, nice=5)
        self._diagnosis = self.publisher(topics.DIAGNOSIS)
        self._model_client = self.create_client(
            SetModel, f'{self.parameters["estimator"]}/set_model'
        )
        self.at_cleanup(lambda: self.destroy_client(self._model_client))
        self._action = ActionServer(
            self,
            Diagnose,
            '~/diagnose',
            execute_callback=lambda _: None,  # each goal is executed with its outcome
            goal_callback=self._asked,
            handle_accepted_callback=self._accepted,
            cancel_callback=lambda _: CancelResponse.ACCEPT,
        )
        self.at_cleanup(self._action.destroy)

    def do_activate(self) -> None:
        """Listen to samples, and to what the estimator makes of them."""
        values = self.parameters.values()
        self.collector = Collector(values['keep'])
        self.loop = live.init(diagnoser_worker.settings(values))
        self.memory = Memory()
        self._remembered = Remembered()
        self._explained = Explained()
        self._last = float('-inf')
        self.every(0.2, self._check)
        self.listen_when_ready()

    def listen(self) -> None:
        """Subscribe: set-ups first, then the samples that they are for."""
        self._setups = Latched(
            self,
            topics.TEST_SETUP,
            lambda message: self._tell(self.collector.setup(from_message(message))),
            of_one_numbering,
        )
        self._estimators = Latched(self, topics.ESTIMATOR_SETUP, self._estimator, newest)
        self.subscribe(topics.BAND, self._band)
        self.subscribe(topics.POSTERIOR, self._posterior)
        self.subscribe(topics.DRAWS, self._draws)
        self.subscribe(topics.SAMPLES, self._block)

    def do_deactivate(self) -> None:
        """Give up a running diagnosis."""
        if self._request is not None:
            if not self.finished:
                self.give_up()
            seconds = time.monotonic() - self._last
            text = f'given up after {seconds:.0f} s: the node was deactivated'
            self.complain('diagnosis', f'{text}; a launch waits longer with linger:=SECONDS')
            self._fail(diagnoser_worker.Outcome(message=text))
        for swap in list(self._swaps):
            swap.cancel()

    def do_report(self) -> None:
        """Coverage, what is being done, and what explains the samples."""
        super().do_report()
        if self.active and (reason := self.collector.unused):
            self.complain('test set-up', f'{reason}: these samples are not diagnosed')
        if hasattr(self, 'loop'):
            self.health.values.update(
                {
                    'coverage of the noise band': self.loop.coverage,
                    'diagnosing': self._request is not None,
                    **self._explained.values(),
                }
            )

    def changed(self, names: set[str]) -> None:
        """New settings hold from what comes next on."""
        if self.active:
            settings = diagnoser_worker.settings(self.parameters.values())
            self.loop = replace(self.loop, settings=settings)

    # Watching.

    def _block(self, message: Any) -> None:
        self._setups.settle()
        self._estimators.settle()
        block = sample_block.from_message(message)
        before = self.collector.received
        self._tell(self.collector.push(block))
        if self.collector.received < before:
            self.memory.forget()
            self._remembered = Remembered()
        self.memory.began(block.stamp_ns)
        if self.collector.received != before:
            self._take(live.Received(self.collector.received))

    def _tell(self, events: list[Event]) -> None:
        for event in events:
            if isinstance(event, Rejected):
                self.complain('bad input', event.message)
            elif isinstance(event, Restarted):
                self._take(live.Began())

    def _estimator(self, message: Any) -> None:
        settings = conversion.estimator_settings(message)
        self.memory.setup(settings, conversion.carried(message))
        self._take(live.Carries(int(message.window)))

    def _band(self, message: Any) -> None:
        if message.scored and message.kind == message.NOISE:
            coverage, number = message.widest_coverage, int(message.window)
            band = message.rms_error, message.widest_width, message.widest_level
            self._take(live.Judged.of(coverage, number, *band))

    def _posterior(self, message: Any) -> None:
        self._explained.posterior(message)
        contradicted = bool(message.prior_contradicted)
        weights, contradicts = conversion.weights(message), float(message.contradicted_for)
        self._take(live.Estimated(contradicted, weights, contradicts))

    def _draws(self, message: Any) -> None:
        if self.loop.trusted and self.memory.settings is not None:
            known = conversion.known(message, self.memory.settings)
            if known is not None:
                self.memory.learn(known, self.collector.first_ns)

    def _take(self, given: live.Input) -> None:
        """Give the live loop an input, and carry out its actions."""
        self.loop, actions = live.step(self.loop, given)
        for action in actions:
            if isinstance(action, live.Look):
                self._look(action)
            elif isinstance(action, live.Carry):
                self._carry(action.proposal)
            else:
                self.complain(action.kind, action.message)

    def _look(self, wanted: live.Look) -> None:
        values = self.parameters.values()
        records, known = looked_at(self.collector, self.memory, wanted.since)
        if not records:
            self._take(live.GivenUp())
            return
        seconds = sum(record.duration for record in records)
        self.get_logger().info(f'diagnosing {seconds:.0f} s: {wanted.reason}')
        self._start(
            diagnoser_worker.Request(
                records=tuple(records),
                known=known,
                seed=values['seed'],
                apply=values['apply'],
                reason=wanted.reason,
                remembered=self._remembered,
            )
        )

    # Diagnosing.

    def _asked(self, goal: Any) -> GoalResponse:
        if not self.active or self._request is not None or self._goal is not None:
            self.get_logger().warning('diagnosis refused: inactive, or one is running')
            return GoalResponse.REJECT
        return GoalResponse.ACCEPT

    def _accepted(self, handle: Any) -> None:
        """Start; the goal is executed, which ends it, when its outcome is there."""
        self._goal = handle
        try:
            streamed = () if handle.request.records else tuple(self.collector.records())
            reason = self.collector.unused
            request = diagnoser_worker.asked(handle.request, streamed, reason)
            if streamed:
                request = replace(request, known=self.memory.before(earliest(streamed)))
            self._take(live.Requested(bool(streamed)))
            self._start(request)
        except InputError as error:
            self._fail(diagnoser_worker.Outcome(message=str(error)))

    def _start(self, request: diagnoser_worker.Request) -> None:
        self._request = request
        self._last = time.monotonic()
        self.worker.submit(diagnoser_worker.work, request)

    def answered(self, answer: Answer) -> None:
        """Take progress, the diagnosis, or that there is none."""
        if self._request is None:
            return
        if answer.kind == PROGRESS:
            self._progress(*answer.payload)
        elif answer.kind in (DIED, FAILED):
            if answer.kind == FAILED:
                self.complain('diagnosis', str(answer.payload), ERROR)
            self._fail(diagnoser_worker.Outcome(message=str(answer.payload)))
        else:
            self._diagnosed(answer.payload)

    def _progress(self, stage: str, share: float) -> None:
        self.health.values['stage'] = f'{stage} ({100 * share:.0f} %)'
        if self._goal is not None:
            self._goal.publish_feedback(Diagnose.Feedback(stage=stage, fraction=share))

    def _diagnosed(self, outcome: diagnoser_worker.Outcome) -> None:
        if outcome.diagnosis is None:
            self.complain('diagnosis', outcome.message)
            self._fail(outcome)
            return
        head = conversion.Head(now_ns(self.get_clock()), outcome.actuator)
        publish(self._diagnosis, head, diagnoser_worker.fields(outcome))
        self._explained.diagnosis(outcome.diagnosis.to_json())
        self.get_logger().info(outcome.message)
        if self.loop.diagnosing == 'the stream':
            self._remembered = outcome.remembered
        self._ended = outcome, self._goal
        self._request = self._goal = None
        self._take(outcome.concluded)
        ended, self._ended = self._ended, None
        if ended is not None:  # nothing is to be carried
            self._finish(*ended)

    def _carry(self, proposal: Proposal) -> None:
        """Have the estimator carry other structures; the diagnosis ends with its answer."""
        assert self._ended is not None
        (outcome, goal), self._ended = self._ended, None
        if not self._model_client.service_is_ready():
            self.complain('set_model', f'{self._model_client.srv_name} is not there')
            self._finish(outcome, goal)
            return

        def answered(future: Any) -> None:
            self._swaps.pop(future, None)
            response = future.result()
            if response is None:
                self.complain('set_model', f'no answer within {ANSWER_SECONDS:g} s')
            elif response.success:
                self.get_logger().info(f'estimator: {response.message}')
                outcome.applied = True
            else:
                self.complain('set_model', f'the estimator refuses: {response.message}')
            self._finish(outcome, goal)

        swap = self._model_client.call_async(diagnoser_worker.requested(proposal))
        self._swaps[swap] = time.monotonic() + ANSWER_SECONDS
        swap.add_done_callback(self.guarded(answered))

    def _check(self) -> None:
        """Give up what is cancelled, and waiting for an answer that was lost."""
        if self._goal is not None and self._request is not None and self._goal.is_cancel_requested:
            self.give_up()
            self._fail(diagnoser_worker.Outcome(message='cancelled'))
        for swap, end in list(self._swaps.items()):
            if time.monotonic() > end:
                swap.cancel()

    def _fail(self, outcome: diagnoser_worker.Outcome) -> None:
        """End without a diagnosis; the loop goes on."""
        goal = self._goal
        self._request = self._goal = None
        self._finish(outcome, goal)
        if self.active:
            self._take(live.GivenUp())

    def _finish(self, outcome: diagnoser_worker.Outcome, goal: Any) -> None:
        self.health.values['last diagnosis'] = outcome.message
        if goal is not None:
            goal.execute(lambda handle: self._result(handle, outcome))

    def _result(self, handle: Any, outcome: diagnoser_worker.Outcome) -> Any:
        """End a goal with its outcome."""
        result = Diagnose.Result(
            success=outcome.diagnosis is not None,
            message=outcome.message,
            applied=outcome.applied,
        )
        head = conversion.Head(now_ns(self.get_clock()), outcome.actuator)
        diagnoser_worker.fill_message(result.diagnosis, head, outcome)
        if handle.is_cancel_requested:
            handle.canceled()
        elif outcome.diagnosis is not None:
            handle.succeed()
        else:
            handle.abort()
        return result


def main(args: list[str] | None = None) -> int:
    """Run the node."""
    return spin.main(DiagnoserNode, args)


if __name__ == '__main__':
    sys.exit(main())
