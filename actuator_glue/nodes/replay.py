"""The samples of a bag, published again, byte for byte where message types are unchanged."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from functools import partial
from typing import Any

from rosgraph_msgs.msg import Clock

from actuator_glue.errors import InputError
from actuator_glue.io.bag_reader import BagMessage, as_published, is_bag, messages, summarise
from actuator_glue.io.bag_samples import SAMPLE_BLOCK, topics_of_actuator
from actuator_glue.io.messages import as_current, deserialize
from actuator_glue.nodes import spin, streamer, topics
from actuator_glue.nodes.pacer import Step
from actuator_glue.nodes.parameters import Spec
from actuator_glue.nodes.partners import type_name

SPECS = (
    Spec('bag', '', 'bag folder or .mcap file', read_only=True),
    Spec('namespace', '', 'whose samples, where a bag has several actuators', read_only=True),
    Spec('results', False, 'publish the recorded results too, not only samples', read_only=True),
    Spec('clock', False, 'publish the recorded time on /clock', read_only=True),
    *streamer.specs(exit_at_end=True),
)
INPUTS = (topics.SAMPLES, topics.TEST_SETUP, topics.PREVIEW)
RESULTS = (*topics.ESTIMATED, topics.MARGIN, topics.DIAGNOSIS)
# What those who join late get too; that of a stream's beginning comes before all else.
SETUPS = frozenset(type_name(topic.type) for topic in (topics.TEST_SETUP, topics.ESTIMATOR_SETUP))


class ReplayNode(streamer.Streamer):
    """Publishes what a bag holds of one actuator, at the pace it was recorded.

    The topics are the node's own, whatever those of the bag are called.
    """

    stamps_now = False

    def __init__(self) -> None:
        super().__init__('replay', SPECS)

    def do_configure(self) -> None:
        """Make the publishers."""
        self.path = self.parameters['bag']
        if not is_bag(self.path):
            raise InputError(f'parameter bag = {self.path!r} is neither a bag nor an .mcap file')
        self.names = self._chosen()
        chosen = INPUTS + (RESULTS if self.parameters['results'] else ())
        self._outputs = {type_name(t.type): self.publisher(t) for t in chosen}
        clock = topics.Topic('/clock', Clock, topics.PREVIEW.qos)
        self._time: Any = self.publisher(clock) if self.parameters['clock'] else None

    def _chosen(self) -> list[str] | None:
        """Return the topics of the actuator that is wanted, None where no topic has samples.

        Raises:
            InputError: there are samples of several and none is chosen, or there are none of the
                one that is.
        """
        summary = summarise(self.path)
        space = self.parameters['namespace'] or None
        if space is None and all(t.type != SAMPLE_BLOCK for t in summary.topics.values()):
            return None
        return topics_of_actuator(self.path, summary, space, 'the parameter namespace')

    def stream(self) -> Iterator[Step]:
        """Yield the messages of the bag, set-ups before their samples, as they were recorded."""
        first: int | None = None
        note = partial(self.complain, 'bag')
        setup = type_name(topics.TEST_SETUP.type)
        wanted = messages(self.path, types=tuple(self._outputs), topics=self.names, note=note)
        for found in as_published(wanted):
            if first is None and found.type in SETUPS:
                self._publish(found)
                if found.type == setup:
                    self.introduce()
                continue
            first = found.log_time if first is None else first
            due = (found.log_time - first) * 1e-9
            yield Step(due, partial(self._publish, found))

    def _publish(self, found: BagMessage) -> None:
        if self._time is not None:
            message = Clock()
            message.clock.sec, message.clock.nanosec = divmod(found.log_time, 1_000_000_000)
            self._time.publish(message)
        data = as_current(found.type, found.data, found.definition)
        self._outputs[found.type].publish(data)
        if found.type == type_name(topics.SAMPLES.type):
            self.samples.add(len(deserialize(found.type, data).command))


def main(args: list[str] | None = None) -> int:
    """Run the node."""
    return spin.main(ReplayNode, args)


if __name__ == '__main__':
    sys.exit(main())
