"""What all nodes share: lifecycle with autostart, parameters, diagnostics, a clean end."""

from __future__ import annotations

import copy
import time
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import chain, islice
from pathlib import Path
from typing import Any

from rclpy.clock import Clock, ClockType, JumpThreshold, TimeJump
from rclpy.duration import Duration
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.time import Time

from actuator_glue.errors import InputError
from actuator_glue.nodes import health, partners
from actuator_glue.nodes.now import begun, now_ns
from actuator_glue.nodes.numbering import Numbering
from actuator_glue.nodes.parameters import Parameters, Spec
from actuator_glue.nodes.topics import DIAGNOSTICS, Topic
from actuator_glue.nodes.transitions import REACHED, answered

COMMON = (
    Spec('autostart', True, 'configure and activate at the start', read_only=True),
    Spec('diagnostics_period', 1.0, 'time between reports', 's', 0.1, 60.0, read_only=True),
)
# Further messages that are taken with one where they wait: an executor looks at all subscriptions
# before each message, which takes longer than to record it.
AT_ONCE = 20
SUCCESS, FAILURE = TransitionCallbackReturn.SUCCESS, TransitionCallbackReturn.FAILURE
ERROR = TransitionCallbackReturn.ERROR
# How long an ending node waits for its listeners [s]: one that hangs never takes its messages.
LAST_WORDS = 1.0


class SuiteNode(LifecycleNode):
    """A lifecycle node of the suite; subclasses fill in the `do_` methods.

    Publishers are made on configure, subscriptions and timers on activate. A callback that
    raises is reported and the node goes on: no data end a node.

    Args:
        name: node name.
        specs: parameters besides the common ones.

    Attributes:
        carries: the node carries samples or records: without it a test is over.
        active: it is active.
        finished: it has ended, by itself or by a service.
        exit_code: of its process, once it has ended.
    """

    carries = False

    def __init__(self, name: str, specs: Sequence[Spec]) -> None:
        super().__init__(name)
        self.exit_code = 0
        self.health = health.Health(self.get_fully_qualified_name())
        self.active = False
        self.finished = False
        # An event without work, which returns a waiting executor to its loop.
        self.wake: Callable[[], None] = self.create_guard_condition(lambda: None).trigger
        self._steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._subscriptions_made: dict[Any, Numbering] = {}
        self._unreceived = 0
        self._made: list[Any] = []
        self._undone: list[Callable[[], object]] = []
        self._timers_made: list[Any] = []
        change = self._service_change_state
        change.callback = answered(
            change.callback,
            lambda: self._state_machine.available_transitions,
            lambda asked: self.complain('transition', f'{asked} is impossible: {self.state}'),
        )
        self.parameters = Parameters(self, (*COMMON, *specs), self.check, self.changed)
        self._diagnostics = self.create_publisher(
            DIAGNOSTICS.type, DIAGNOSTICS.name, DIAGNOSTICS.qos
        )
        self._jumps = self.get_clock().create_jump_callback(
            JumpThreshold(
                min_forward=None, min_backward=Duration(nanoseconds=-1), on_clock_change=True
            ),
            post_callback=self._jumped,
        )

    # What subclasses fill in.

    def check(self, values: Mapping[str, Any]) -> None:
        """Refuse parameter values with an InputError; called with all values at once."""

    def changed(self, names: set[str]) -> None:
        """React to parameters changed at run time."""

    def do_configure(self) -> None:
        """Read parameters, make publishers; an InputError refuses the transition."""

    def do_activate(self) -> None:
        """Make subscriptions and timers, start to work; an InputError refuses the transition."""

    def do_deactivate(self) -> None:
        """Stop working; subscriptions and timers are removed afterwards."""

    def do_report(self) -> None:
        """Bring `health.values` up to date."""

    def clock_jumped(self) -> None:
        """The node's clock went back, or changed between system and simulated time."""

    # What subclasses use.

    def publisher(self, topic: Topic) -> Any:
        """Return a publisher that lives until cleanup; parameters override its QoS."""
        made = self.create_publisher(
            topic.type,
            topic.name,
            copy.copy(topic.qos),  # overriding writes into it
            qos_overriding_options=partners.OVERRIDES,
        )
        self._made.append(made)
        self.at_cleanup(lambda: self.destroy_publisher(made))
        return made

    def subscribe(
        self,
        topic: Topic,
        callback: Callable[..., None],
        *,
        info: bool = False,
        raw: bool = False,
        overrides: bool = True,
    ) -> Any:
        """Subscribe until deactivation; what the callback raises is reported.

        Args:
            topic: what to subscribe to.
            callback: gets the message; with `info` also what the middleware knows of it.
            info: whether the callback takes two arguments.
            raw: do not decode.
            overrides: parameters override the QoS.
        """
        call, numbers = self.guarded(callback), Numbering()

        def take(data: Any, known: Any) -> None:
            if not topic.shared:
                numbers.take(known)
            if info:
                call(data, known)
            else:
                call(data)

        def taken(data: Any, known: Any) -> None:
            take(data, known)
            for found in islice(self.arrived(made), AT_ONCE) if self.active else ():
                take(*found)

        made = self.create_subscription(
            topic.type,
            topic.name,
            taken,
            copy.copy(topic.qos),  # overriding writes into it
            raw=raw,
            qos_overriding_options=partners.OVERRIDES if overrides else None,
        )
        self._subscriptions_made[made] = numbers
        return made

    @property
    def unreceived(self) -> int:
        """Number of messages that were sent to the subscriptions and did not arrive."""
        return self._unreceived + sum(n.lost for n in self._subscriptions_made.values())

    @staticmethod
    def arrived(made: Any) -> Iterator[tuple[Any, Any]]:
        """Take what has arrived at a subscription and was not handed to its callback yet.

        An executor takes one message of each subscription in turn: of two set-ups and a sample
        that wait together, the second set-up would come after the sample.
        """
        while True:
            with made.handle:
                taken = made.handle.take_message(made.msg_type, made.raw)
            if taken is None:
                return
            yield taken

    def unsubscribe(self, made: Any) -> None:
        """End a subscription before deactivation does."""
        self._unreceived += self._subscriptions_made.pop(made).lost
        self.destroy_subscription(made)

    def every(self, period: float, callback: Callable[[], None]) -> Any:
        """Call back every `period` seconds of steady time until deactivation; return the timer."""
        made = self.create_timer(period, self.guarded(callback), clock=self._steady)
        self._timers_made.append(made)
        return made

    def guarded(self, callback: Callable[..., Any]) -> Callable[..., None]:
        """Return the callback with everything it raises reported instead."""

        def call(*args: Any) -> None:
            try:
                callback(*args)
            except InputError as error:
                self.complain('bad input', str(error))
            except Exception as error:
                self.complain_of_bug(error)

        return call

    def complain(self, kind: str, message: str, level: Any = health.WARN) -> None:
        """Log a fault (one that lasts, once) and show it on /diagnostics."""
        if self.health.fault(kind, message, time.monotonic(), level):
            # rclpy ties a severity to the line that logs: one line each.
            if level == health.ERROR:
                self.get_logger().error(f'{kind}: {message}')
            else:
                self.get_logger().warning(f'{kind}: {message}')

    def complain_of_bug(self, error: BaseException) -> None:
        """Report an exception nobody foresaw; the node goes on."""
        self.get_logger().debug(''.join(traceback.format_exception(error)))
        last = traceback.extract_tb(error.__traceback__)[-1:]
        where = ''.join(f' ({Path(f.filename).name}:{f.lineno})' for f in last)
        self.complain('internal error', f'{type(error).__name__}: {error}{where}', health.ERROR)

    # Lifecycle.

    @property
    def state(self) -> str:
        """Lifecycle state."""
        return str(self._state_machine.current_state[1])

    def on_configure(self, state: LifecycleState) -> Any:
        """Configure; a refusal is logged."""

        def work() -> None:
            try:
                self.do_configure()
            except BaseException:
                self._clean()
                raise

        return self._transition('configure', work, super().on_configure, state)

    def on_activate(self, state: LifecycleState) -> Any:
        """Activate; a refusal is logged."""

        def work() -> None:
            self.every(self.parameters['diagnostics_period'], self._report)
            self.active = True
            try:
                self.do_activate()
            except BaseException:
                self._stop()
                raise

        return self._transition('activate', work, super().on_activate, state)

    def on_deactivate(self, state: LifecycleState) -> Any:
        """Deactivate."""
        return self._transition('deactivate', self._stop, super().on_deactivate, state)

    def on_cleanup(self, state: LifecycleState) -> Any:
        """Clean up."""
        return self._transition('clean up', self._clean, super().on_cleanup, state)

    def on_shutdown(self, state: LifecycleState) -> Any:
        """Stop and clean up from whatever state."""

        def work() -> None:
            self.finished = True
            self._release()
            self.wake()

        return self._transition('shut down', work, super().on_shutdown, state)

    def on_error(self, state: LifecycleState) -> Any:
        """Return to unconfigured after an error, ready to be configured again."""
        return self._transition('recover', self._release, super().on_error, state)

    def _transition(
        self, name: str, work: Callable[[], None], base: Callable[..., Any], state: Any
    ) -> Any:
        try:
            work()
        except InputError as error:
            self.get_logger().error(f'cannot {name}: {error}')
            self.health.fault(f'cannot {name}', str(error), time.monotonic(), health.ERROR)
            self._report(f'cannot {name}')
            return FAILURE
        except Exception as error:
            self.get_logger().error(
                f'cannot {name}: ' + ''.join(traceback.format_exception(error))
            )
            return ERROR
        reached = REACHED.get(name, name)
        self.get_logger().info(reached)
        self._report(reached)
        return base(state)

    def _release(self) -> None:
        self._stop()
        self._clean()

    def _stop(self) -> None:
        if not self.active:
            return
        self.active = False
        try:
            self.do_deactivate()
        finally:
            for timer in self._timers_made:
                self.destroy_timer(timer)
            for subscription in self._subscriptions_made:
                self.destroy_subscription(subscription)
            self._timers_made.clear()
            self._subscriptions_made.clear()
            self._unreceived = 0

    def at_cleanup(self, undo: Callable[[], object]) -> None:
        """Have cleanup call this to undo a part of do_configure; the last part goes first."""
        self._undone.append(undo)

    def _clean(self) -> None:
        self.until_heard()
        self._made.clear()
        while self._undone:
            self._undone.pop()()

    def until_heard(self) -> None:
        """Wait until listeners have the last messages, `LAST_WORDS` at most.

        Messages that a publisher has not handed over when it goes are lost, however reliable.
        """
        end = time.monotonic() + LAST_WORDS
        for made in (*self._made, self._diagnostics):
            left = max(end - time.monotonic(), 0.0)
            made.wait_for_all_acked(Duration(seconds=left))

    # Diagnostics.

    def _report(self, state: str | None = None) -> None:
        self._check_partners()
        self.do_report()
        if not begun(self.get_clock()):
            self.complain(
                'clock',
                'use_sim_time is set and nothing has come on /clock yet; until then this is '
                "stamped with the computer's time",
            )
        stamp = Time(nanoseconds=now_ns(self.get_clock())).to_msg()
        message = self.health.message(time.monotonic(), stamp, state or self.state)
        self._diagnostics.publish(message)

    def _check_partners(self) -> None:
        """Report partners with which DDS will never exchange a message, and those in turn."""
        for made, numbers in self._subscriptions_made.items():
            if told := numbers.in_turn(self, made.topic_name):
                self.complain('publishers', told, health.ERROR)
        lost, told = self.unreceived, self.health.values.get('messages not received', 0)
        if self._subscriptions_made:
            self.health.values['messages not received'] = lost
        if lost > told:
            self.complain(
                'not received',
                f'{lost - told} messages that were sent did not reach this node: it, the computer '
                'or the network is too slow; larger blocks are fewer messages',
            )
        listening = (partners.unheard(self, made) for made in self._subscriptions_made)
        sending = (partners.unreached(self, made) for made in self._made)
        for kind, text in chain(*listening, *sending):
            self.complain(kind, text)

    def _jumped(self, jump: TimeJump) -> None:
        if jump.delta is not None and jump.delta.nanoseconds < 0:
            seconds = jump.delta.nanoseconds * 1e-9
            self.complain('clock', f'the clock jumped by {seconds:.3f} s')
        self.guarded(self.clock_jumped)()
