"""What the model lacks: diagnosis on request, or by itself when coverage breaks."""

from __future__ import annotations

import sys
import time
from collections.abc import Mapping
from typing import Any

from actuator_glue_msgs.action import Diagnose
from actuator_glue_msgs.srv import SetModel
from rclpy.action import ActionServer, CancelResponse, GoalResponse

from actuator_glue import sample_block
from actuator_glue.diagnosis.verdict import against
from actuator_glue.errors import InputError
from actuator_glue.nodes import diagnoser_worker, own_effects, spin, topics
from actuator_glue.nodes.health import ERROR
from actuator_glue.nodes.latched import Newest
from actuator_glue.nodes.messages import publish
from actuator_glue.nodes.working import WorkingNode
from actuator_glue.online import conversion
from actuator_glue.online.alarm import CoverageAlarm, SwapWatch
from actuator_glue.online.collect import Collector
from actuator_glue.online.stream import Event, Rejected, Restarted
from actuator_glue.setups import from_message
from actuator_glue.workers.worker import DIED, FAILED, PROGRESS, Answer

# How long the estimator may take to say whether it takes the augmented model [s].
ANSWER_SECONDS = 10.0


class DiagnoserNode(WorkingNode):
    """Collects samples, watches the coverage, and has a worker process diagnose."""

    def __init__(self) -> None:
        self._goal: Any = None
        self._request: diagnoser_worker.Request | None = None
        self._swap: Any = None
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
            execute_callback=self._conclude,
            goal_callback=self._asked,
            handle_accepted_callback=self._accepted,
            cancel_callback=lambda _: CancelResponse.ACCEPT,
        )
        self.at_cleanup(self._action.destroy)

    def do_activate(self) -> None:
        """Listen to samples and bands."""
        values = self.parameters.values()
        self.collector = Collector(values['keep'])
        self.alarm = CoverageAlarm(values['coverage_limit'], values['coverage_windows'])
        self.swaps = SwapWatch()
        self._last = float('-inf')
        self._pending = False
        self.every(0.2, self._check)
        self.listen_when_ready()

    def listen(self) -> None:
        """Subscribe: set-ups first, then the samples that they are for."""
        self._setups = Newest(
            self,
            topics.TEST_SETUP,
            lambda message: self._tell(self.collector.setup(from_message(message))),
        )
        self.subscribe(topics.BAND, self._band)
        self.subscribe(topics.SAMPLES, self._block)

    def do_deactivate(self) -> None:
        """Give up a running diagnosis."""
        if self._request is not None:
            if not self.finished:
                self.give_up()
            seconds = time.monotonic() - self._last
            text = f'given up after {seconds:.0f} s: the node was deactivated'
            self.complain('diagnosis', f'{text}; a launch waits longer with linger:=SECONDS')
            self._finish(diagnoser_worker.Outcome(message=text))

    def do_report(self) -> None:
        """Coverage and what is being done."""
        super().do_report()
        if hasattr(self, 'alarm'):
            self.health.values.update(
                {
                    'coverage of the noise band': self.alarm.coverage,
                    'diagnosing': self._request is not None,
                }
            )

    def changed(self, names: set[str]) -> None:
        """A new limit holds from the next band on."""
        if self.active:
            self.alarm.limit = self.parameters['coverage_limit']

    # Watching.

    def _block(self, message: Any) -> None:
        self._setups.settle()
        self._tell(self.collector.push(sample_block.from_message(message)))

    def _tell(self, events: list[Event]) -> None:
        for event in events:
            if isinstance(event, Rejected):
                self.complain('bad input', event.message)
            elif isinstance(event, Restarted):
                self.alarm.reset()
                self.swaps.reset()

    def _band(self, message: Any) -> None:
        if not message.scored or message.kind != message.NOISE:
            return
        ratio = self.swaps.update(message.rms_error)
        if ratio:
            self._take_back(ratio)
        if self.alarm.update(message.widest_coverage):
            self._pending = True
            self.complain(
                'coverage',
                f'the {100 * message.widest_level:g} % band of parameters and sensor noise covers '
                f'{100 * self.alarm.coverage:.0f} % of the samples: the model lacks something',
            )
        if self._pending and self.parameters['automatic'] and self._request is None:
            self._start_by_itself()

    def _start_by_itself(self) -> None:
        values = self.parameters.values()
        if time.monotonic() - self._last < values['pause']:
            return
        records = self.collector.records()
        if sum(r.duration for r in records) < values['minimum']:
            return
        self._pending = False
        self.get_logger().info('diagnosing what was received lately')
        self._start(
            diagnoser_worker.Request(
                records=tuple(records), seed=values['seed'], apply=values['apply']
            )
        )

    # Diagnosing.

    def _asked(self, goal: Any) -> GoalResponse:
        if not self.active or self._request is not None or self._goal is not None:
            self.get_logger().warning('diagnosis refused: inactive, or one is running')
            return GoalResponse.REJECT
        return GoalResponse.ACCEPT

    def _accepted(self, handle: Any) -> None:
        """Start; the goal is executed, which ends it, when the outcome is there."""
        self._goal = handle
        try:
            live = () if handle.request.records else tuple(self.collector.records())
            self._start(diagnoser_worker.asked(handle.request, live))
        except InputError as error:
            self._finish(diagnoser_worker.Outcome(message=str(error)))

    def _start(self, request: diagnoser_worker.Request) -> None:
        self._request = request
        self._overall = diagnoser_worker.Overall()
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
            self._finish(diagnoser_worker.Outcome(message=str(answer.payload)))
        else:
            self._diagnosed(answer.payload)

    def _progress(self, stage: str, share: float) -> None:
        self.health.values['stage'] = f'{stage} ({100 * share:.0f} %)'
        if self._goal is not None:
            fraction = self._overall(stage, share)
            self._goal.publish_feedback(Diagnose.Feedback(stage=stage, fraction=fraction))

    def _diagnosed(self, outcome: diagnoser_worker.Outcome) -> None:
        request = self._request
        if outcome.diagnosis is None or request is None:
            self.complain('diagnosis', outcome.message)
            self._finish(outcome)
            return
        head = conversion.Head(self.get_clock().now().nanoseconds, outcome.actuator)
        publish(self._diagnosis, head, diagnoser_worker.fields(outcome))
        self.get_logger().info(outcome.message)
        why_not = against(outcome.diagnosis)
        if request.apply and not why_not:
            self._apply(outcome)
            return
        if request.apply:
            self.get_logger().info(f'the estimator goes on as it is: {why_not}')
        self._finish(outcome)

    def _apply(self, outcome: diagnoser_worker.Outcome) -> None:
        diagnosis = outcome.diagnosis
        assert diagnosis is not None
        if not self._model_client.service_is_ready():
            self.complain('set_model', f'{self._model_client.srv_name} is not there')
            self._finish(outcome)
            return
        request = self._request

        def answered(future: Any) -> None:
            if self._request is not request:
                return
            response = future.result()
            if response is None:
                self.complain('set_model', f'no answer within {ANSWER_SECONDS:g} s')
            elif response.success:
                self.get_logger().info(f'estimator: {response.message}')
                self.alarm.reset()
                self.swaps.swapped()
                outcome.applied = True
            else:
                self.complain('set_model', f'the estimator refuses: {response.message}')
            self._finish(outcome)

        self._swap = self._model_client.call_async(diagnoser_worker.augmented(diagnosis))
        self._swap.add_done_callback(self.guarded(answered))
        self._swap_end = time.monotonic() + ANSWER_SECONDS

    def _take_back(self, ratio: float) -> None:
        """Have the estimator go back to Eq. (2), for the augmented model forecasts worse."""
        self.complain(
            'swap',
            f'forecasts err {ratio:.2f} times as much as before the model was augmented: back to '
            'Eq. (2)',
        )
        if self._model_client.service_is_ready():
            self._model_client.call_async(SetModel.Request())
            self.alarm.reset()

    def _check(self) -> None:
        """Give up what is cancelled, and waiting for an answer that was lost."""
        if self._goal is not None and self._request is not None and self._goal.is_cancel_requested:
            self.give_up()
            self._finish(diagnoser_worker.Outcome(message='cancelled'))
        if self._swap is not None and time.monotonic() > self._swap_end:
            self._swap.cancel()

    def _finish(self, outcome: diagnoser_worker.Outcome) -> None:
        self._request = self._swap = None
        self._outcome = outcome
        self.health.values['last diagnosis'] = outcome.message
        if self._goal is not None:
            self._goal.execute()

    def _conclude(self, handle: Any) -> Any:
        """End a goal whose outcome is known."""
        outcome, self._goal = self._outcome, None
        result = Diagnose.Result(
            success=outcome.diagnosis is not None,
            message=outcome.message,
            applied=outcome.applied,
        )
        head = conversion.Head(self.get_clock().now().nanoseconds, outcome.actuator)
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
