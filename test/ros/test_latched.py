"""Messages that were sent before one listened: the newest counts, or all of a numbering."""

import time
from types import SimpleNamespace

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.nodes.latched import Latched, newest, of_one_numbering
from actuator_glue.nodes.topics import ESTIMATOR_SETUP, TEST_SETUP
from actuator_glue.online.settings import EstimatorSettings
from actuator_glue.online.windows import SlidingWindows
from actuator_glue.sample_block import Block
from actuator_glue.setups import StreamSetup


def listening(topic=ESTIMATOR_SETUP, counts=newest):
    """A subscription, what it hands over, and a way to send to it."""
    node, taken = SimpleNamespace(), []

    def take(message) -> None:
        if message == 'refused':
            raise InputError('refused')
        taken.append(message)

    def guarded(callback):
        def call(message) -> None:
            try:
                callback(message)
            except InputError as error:
                node.complaint = str(error)

        return call

    node.guarded = guarded
    node.subscribe = lambda topic, callback, info: setattr(node, 'send', callback)
    node.arrived = lambda made: ()
    node.every = lambda period, callback: setattr(node, 'tick', callback)
    latched = Latched(node, topic, take, counts)

    def sent(message, ago: float) -> None:
        node.send(message, {'source_timestamp': (time.time() - ago) * 1e9})

    return latched, node, sent, taken


def set_up(index: int, at: int, stiffness: float = 0.0):
    """What is needed of a TestSetup."""
    stamp = SimpleNamespace(sec=at, nanosec=0)
    return SimpleNamespace(
        index=index, header=SimpleNamespace(stamp=stamp), specimen_stiffness=stiffness
    )


def test_of_old_messages_the_newest_is_handed_over(monkeypatch):
    now = [100.0]
    clock = SimpleNamespace(time=time.time, monotonic=lambda: now[0])
    monkeypatch.setattr('actuator_glue.nodes.latched.time', clock)
    latched, node, sent, taken = listening()
    for text, ago in (('bad', 30.0), ('old', 20.0), ('new', 10.0), ('of another publisher', 15.0)):
        sent(text, ago)
    node.tick()
    assert not taken  # others may follow
    now[0] += 0.11
    node.tick()
    assert taken == ['new']
    latched.settle()
    sent('met later', 12.0)
    latched.settle()
    assert taken == ['new']


def test_a_sample_does_not_wait_for_its_set_up():
    latched, _, sent, taken = listening()
    sent('old', 20.0)
    latched.settle()
    assert taken == ['old']


def test_what_is_sent_from_then_on_is_handed_over_one_by_one():
    _, _, sent, taken = listening()
    sent('old', 20.0)
    sent('first', -1.0)
    sent('second', -1.0)
    assert taken == ['old', 'first', 'second']


def test_what_has_arrived_comes_before_the_sample_that_waits_beside_it():
    """An executor takes one message of each subscription in turn, whatever waits."""
    latched, node, sent, taken = listening()
    sent('first', -1.0)
    later = {'source_timestamp': (time.time() + 2.0) * 1e9}
    node.arrived = lambda made: iter((('second', later), ('third', later)))
    latched.settle()
    assert taken == ['first', 'second', 'third']


def test_set_ups_announced_ahead_are_all_handed_over_in_order_of_sending():
    """Who joins late knows what governs each sample, and not only what will govern some."""
    latched, _, sent, taken = listening(TEST_SETUP, of_one_numbering)
    first, again, ahead = set_up(0, 100), set_up(0, 100), set_up(20000, 120)
    for message, ago in ((first, 30.0), (ahead, 10.0), (again, 20.0)):
        sent(message, ago)
    latched.settle()
    assert taken == [again, ahead]
    # Whatever the order they are announced in.
    latched, _, sent, taken = listening(TEST_SETUP, of_one_numbering)
    sent(ahead, 20.0)
    sent(first, 10.0)
    latched.settle()
    assert taken == [ahead, first]


def test_who_joins_late_has_every_sample_under_its_set_up():
    latched, _, sent, taken = listening(TEST_SETUP, of_one_numbering)
    sent(set_up(0, 100, 0.0), 20.0)
    sent(set_up(200, 102, 1e5), 10.0)
    latched.settle()
    windows = SlidingWindows(EstimatorSettings(window=0.5, hop=0.5, settle=0.1, time_budget=0.4))
    for message in taken:
        windows.setup(StreamSetup(message.specimen_stiffness, 0.01, index=message.index))
    found = []
    for index in range(0, 400, 50):
        samples = np.zeros(50)
        block = Block(index, 0.01, round(1e7 * index) + 1, samples, samples)
        found += windows.push(block)[1]
    assert {w.record.stiffness for w in found if w.record.first_index < 200} == {0.0}
    assert {w.record.stiffness for w in found if w.record.first_index >= 200} == {1e5}


def test_set_ups_of_a_stream_that_began_again_are_not_mixed():
    """Its numbers are others: what the old ones announced would hold at the wrong samples."""
    latched, _, sent, taken = listening(TEST_SETUP, of_one_numbering)
    new, later = set_up(0, 200), set_up(3000, 203)
    for i, message in enumerate((set_up(0, 100), set_up(5000, 105), new, later)):
        sent(message, 20.0 - i)
    latched.settle()
    assert taken == [new, later]


def test_one_that_is_refused_costs_nothing_else():
    latched, node, sent, taken = listening(TEST_SETUP, lambda before, after: True)
    sent('refused', 20.0)
    sent('good', 10.0)
    latched.settle()
    assert (taken, node.complaint) == (['good'], 'refused')
