"""What simulator, laboratory bridge and replay share: a stream that is published on time."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from rclpy.duration import Duration

from actuator_glue.nodes import base, topics
from actuator_glue.nodes.health import Rate
from actuator_glue.nodes.pacer import Pacer, Step
from actuator_glue.nodes.parameters import Spec

# How long a stream waits for subscribers that lag, at its beginning and its end [s]. DDS lets go
# of a dead one after its lease of 20 s, so that more is never needed. Workers compile before their
# nodes subscribe: that takes minutes, and is waited for without limit.
PATIENCE_SECONDS = 30.0
# A stream that is further behind its time is a warning [s]: it may catch up, or never.
BEHIND_SECONDS = 1.0
# How often a stream that waits says so [s].
REMINDER_SECONDS = 5.0


def specs(*, exit_at_end: bool) -> tuple[Spec, ...]:
    """Return the parameters of a stream; whether its end ends the node differs."""
    return (
        Spec('speed', 1.0, 'stream seconds per second, 0 for no waiting', '1', 0.0, 1e4, True),
        Spec('exit_at_end', exit_at_end, 'end the node when the stream has ended', read_only=True),
        Spec(
            'wait_for',
            0,
            'subscribers of the samples, ready for them, to wait for',
            '1',
            0,
            100,
            True,
        ),
    )


class Streamer(base.SuiteNode):
    """A node that publishes a stream from a thread of its own; subclasses give `stream`.

    Attributes:
        stamps_now: samples are stamped with the node's clock (a replay keeps recorded stamps, and
            may be what publishes /clock).
    """

    stamps_now = True
    carries = True

    def __init__(self, name: str, specs: Sequence[Spec]) -> None:
        super().__init__(name, specs)
        self.samples = Rate()
        self.pacer: Pacer | None = None
        self._waited_for: str | None = None
        self._introduced = False
        self._told = 0.0

    def stream(self) -> Iterator[Step]:
        """Yield what is published, and when; runs in the pacer's thread."""
        raise NotImplementedError

    def publisher(self, topic: topics.Topic) -> Any:
        """Return a publisher that lives until cleanup."""
        made = super().publisher(topic)
        if topic is topics.SAMPLES:
            self._samples_out = made
        if topic is topics.TEST_SETUP:
            self._setup_out = made
        return made

    @property
    def speed(self) -> float:
        """Stream seconds per second, 0 for no waiting."""
        return float(self.parameters['speed'])

    @property
    def simulated_time(self) -> bool:
        """Whether /clock paces the stream; a node that may publish /clock cannot wait for it."""
        return self.stamps_now and bool(self.get_parameter('use_sim_time').value)

    def _simulated(self) -> float:
        return 1e-9 * float(self.get_clock().now().nanoseconds)

    @property
    def subscribers(self) -> int:
        """Number of subscribers our publisher has met: others would miss the first samples."""
        return int(self._samples_out.get_subscription_count())

    def ready(self) -> bool:
        """Whether everybody who was waited for listens and the clock has begun."""
        wanted, there = self.parameters['wait_for'], self.subscribers
        missing = ''
        if there < wanted:
            missing = (
                f'{wanted} subscribers of samples, {there} {"is" if there == 1 else "are"} there; '
                'a node subscribes once its code is compiled, which takes minutes at a first start'
            )
        elif self.stamps_now and self.get_clock().now().nanoseconds == 0:
            # Simulated time is 0 until the first /clock: such stamps would jump with it.
            missing = 'the first /clock'
        now = time.monotonic()
        if missing != self._waited_for or (missing and now - self._told > REMINDER_SECONDS):
            self._waited_for, self._told = missing, now
            if missing:
                self.get_logger().info(f'waiting for {missing}')
        return not missing

    def introduce(self, prepare: Callable[[], None] = lambda: None) -> None:
        """Wait until whoever was waited for has the first test set-up; call it in the stream.

        That our publisher has met a subscriber says nothing of the other way round: DDS may yet
        have to tell the subscriber, who misses what is sent until then. It is told of publishers
        in the order they were made, and that of samples comes before that of set-ups.

        Args:
            prepare: the last thing to do before it is said that the stream begins.
        """
        if self.parameters['wait_for']:
            self._wait_until_taken(self._setup_out)
        prepare()
        if not self._introduced:
            # Not before: a program that waits for this line sends at once.
            self.get_logger().info('the stream begins')
        self._introduced = True

    def do_activate(self) -> None:
        """Begin the stream."""
        self.samples = Rate()
        self._waited_for, self._introduced = None, False
        clock = self._simulated if self.simulated_time else None
        self.pacer = Pacer(
            self.stream(), self.ready, self.speed, self._ended, clock, self.clock_jumped
        )
        self.pacer.start()

    def do_deactivate(self) -> None:
        """Stop the stream after the message being published."""
        if self.pacer is not None:
            self.pacer.stop()

    def do_report(self) -> None:
        """Rate, lateness and who listens."""
        if self.active:
            self.health.values['subscribers'] = self.subscribers
        if self.pacer is not None:
            self.health.values.update(
                {
                    'sample rate (1/s)': self.samples.per_second(time.monotonic()),
                    'samples': self.samples.count,
                    'late messages': self.pacer.late,
                    'latest message (s)': self.pacer.latest,
                }
            )
            if self.active and self.pacer.behind > BEHIND_SECONDS:
                self.complain(
                    'behind',
                    f'samples are published more than {BEHIND_SECONDS:g} s after their time: this '
                    'computer is busy, or messages are too many for it; larger blocks are fewer',
                )

    def _ended(self, failure: BaseException | None) -> None:
        if failure is not None:
            self.complain_of_bug(failure)
        # Messages that subscribers still lack would be lost with their publisher.
        self._wait_until_taken(*self._made)
        self.get_logger().info(f'stream ended after {self.samples.count} samples')
        if self.parameters['exit_at_end']:
            self.finished = True
            self.wake()

    def _wait_until_taken(self, *outs: Any) -> None:
        """Wait until subscribers have all that was published."""
        end = time.monotonic() + PATIENCE_SECONDS
        for out in outs:
            while not out.wait_for_all_acked(Duration(seconds=0.1)):
                if self.pacer is None or self.pacer.stopped:
                    return
                if time.monotonic() > end:
                    self.complain('subscribers', f'not all of {out.topic_name} was taken')
                    return
