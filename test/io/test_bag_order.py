"""Topics have no order among each other: a set-up recorded late still comes before its samples."""

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from actuator_glue.errors import InputError
from actuator_glue.io.bag_reader import WAITING, BagMessage, as_published
from actuator_glue.io.messages import full_name


def sent(kind, *times):
    """Messages of one topic, published at these times, all received later."""
    return [BagMessage(kind, full_name(kind), b'', 1000, t) for t in times]


def test_a_set_up_comes_before_the_samples_published_after_it():
    blocks, (setup,) = sent('SampleBlock', 1, 3, 5), sent('TestSetup', 2)
    assert list(as_published([*blocks, setup])) == [blocks[0], setup, *blocks[1:]]


@given(st.lists(st.tuples(st.booleans(), st.integers(0, 50)), max_size=60))
def test_every_message_comes_once_and_each_topic_in_its_order(pieces):
    """Whatever the clocks do: a step back must not shuffle samples."""
    found = [sent('TestSetup' if setup else 'SampleBlock', t)[0] for setup, t in pieces]
    ordered = list(as_published(found))
    for kind in 'TestSetup', 'SampleBlock':
        before, after = ([id(m) for m in ms if m.topic == kind] for ms in (found, ordered))
        assert after == before


def test_what_waits_to_be_ordered_does_not_grow_and_survives_damage():
    def damaged():
        yield from sent('SampleBlock', *range(WAITING + 500))
        raise InputError('cut')

    seen, source = [], as_published(damaged())
    with pytest.raises(InputError, match='cut'):
        for message in source:
            seen.append(message.publish_time)
    assert seen == list(range(WAITING + 500))
    endless = as_published(sent('SampleBlock', t)[0] for t in itertools.count())
    assert next(endless).publish_time == 0
    assert len(endless.gi_frame.f_locals['waiting']) == WAITING
