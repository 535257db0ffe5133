"""Set-ups that were sent before one listened: the newest counts."""

import time
from types import SimpleNamespace

from actuator_glue.nodes.latched import Newest
from actuator_glue.nodes.topics import TEST_SETUP


def listening():
    """A subscription, what it hands over, and a way to send to it."""
    node, taken = SimpleNamespace(), []
    node.subscribe = lambda topic, callback, info: setattr(node, 'send', callback)
    node.every = lambda period, callback: setattr(node, 'tick', callback)
    newest = Newest(node, TEST_SETUP, taken.append)

    def sent(text: str, ago: float) -> None:
        node.send(text, {'source_timestamp': (time.time() - ago) * 1e9})

    return newest, node, sent, taken


def test_of_old_messages_the_newest_is_handed_over(monkeypatch):
    now = [100.0]
    clock = SimpleNamespace(time=time.time, monotonic=lambda: now[0])
    monkeypatch.setattr('actuator_glue.nodes.latched.time', clock)
    newest, node, sent, taken = listening()
    for text, ago in (('bad', 30.0), ('old', 20.0), ('new', 10.0), ('of another publisher', 15.0)):
        sent(text, ago)
    node.tick()
    assert not taken  # others may follow
    now[0] += 0.11
    node.tick()
    assert taken == ['new']
    newest.settle()
    assert taken == ['new']


def test_a_sample_does_not_wait_for_its_set_up():
    newest, _, sent, taken = listening()
    sent('old', 20.0)
    newest.settle()
    assert taken == ['old']


def test_what_is_sent_from_then_on_is_handed_over_one_by_one():
    _, _, sent, taken = listening()
    sent('old', 20.0)
    sent('first', -1.0)
    sent('second', -1.0)
    assert taken == ['old', 'first', 'second']
