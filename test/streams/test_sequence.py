"""Sequence numbers: every sample once, in order, and every one that is missing a gap."""

from collections import Counter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from actuator_glue.streams.sequence import HOLD_SAMPLES, HOLD_SECONDS, Sequence

RATE = 1000.0


class Wire:
    """A sequence that is fed one sample per millisecond; the value of each is its number."""

    def __init__(self, modulus=None, restarts=True):
        self.counts = Counter()
        self.sequence = Sequence(RATE, modulus, restarts=restarts, counts=self.counts)
        self.modulus, self.now, self.found, self.began = modulus, 0.0, [], 0

    def feed(self, numbers, size=1):
        for start in range(0, len(numbers), size):
            part = np.array(numbers[start : start + size], dtype=np.int64)
            rows = part[:, None].astype(float)
            self.now += len(part) / RATE
            wire = part % self.modulus if self.modulus else part
            self.take(self.sequence.push(wire, rows, self.now))
        return self

    def end(self):
        self.now += 2 * HOLD_SECONDS
        self.take(self.sequence.waited(self.now))
        return self

    def take(self, runs):
        for run in runs:
            self.began += run.began
            self.found += [(run.index + i, value) for i, value in enumerate(run.rows[:, 0])]


@pytest.mark.parametrize('size', [1, 7, 100])
def test_what_is_in_order_is_handed_on(size):
    wire = Wire().feed(list(range(50, 1050)), size)
    assert wire.found == [(i, 50.0 + i) for i in range(1000)]
    assert not +wire.counts


@pytest.mark.parametrize('modulus', [None, 256, 65_536])
@given(data=st.data())
def test_lost_repeated_and_exchanged_samples_are_put_right(modulus, data):
    """Of 400 samples some are lost, some come twice, neighbours are exchanged."""
    lost = data.draw(st.sets(st.integers(5, 390), max_size=30))
    twice = data.draw(st.sets(st.integers(5, 390), max_size=30)) - lost
    moved = data.draw(st.sets(st.integers(5, 390), max_size=30)) - lost - twice
    size = data.draw(st.sampled_from([1, 3, 50]))
    sent = []
    for number in range(400):
        if number not in lost:
            sent += [number] * (2 if number in twice else 1)
    for number in sorted(moved):
        at = sent.index(number)
        later = min(at + 3, len(sent) - 1)
        sent.insert(later, sent.pop(at))
    wire = Wire(modulus).feed(sent, size).end()
    assert wire.found == [(n, float(n)) for n in range(400) if n not in lost]
    assert wire.counts['lost'] == len(lost)
    assert wire.counts['duplicates'] == len(twice)
    assert not wire.counts['restarts'] and not wire.counts['late']


def test_one_that_comes_after_its_gap_was_told_is_late():
    wire = Wire().feed([0, 1, 2, 4, *range(5, 100)])
    assert wire.counts['lost'] == 1
    wire.feed([3])
    assert wire.counts['late'] == 1 and wire.counts['duplicates'] == 0
    wire.feed([3])
    assert wire.counts['duplicates'] == 1
    assert [v for _, v in wire.found] == [0.0, 1.0, 2.0, *map(float, range(4, 100))]


@pytest.mark.parametrize('modulus', [None, 65_536])
def test_a_sender_that_begins_anew_begins_a_stream(modulus):
    wire = Wire(modulus).feed(list(range(500, 1500))).feed(list(range(100)))
    assert wire.began == 2 and wire.counts['restarts'] == 1
    assert wire.found[1000:] == [(i, float(i)) for i in range(100)]
    assert not wire.counts['lost'] and not wire.counts['implausible']


def test_a_signed_sender_may_not_begin_anew():
    """Somebody who recorded it could send it again."""
    wire = Wire(restarts=False).feed(list(range(1000))).feed(list(range(500)))
    assert len(wire.found) == 1000
    assert wire.counts['implausible'] + wire.counts['duplicates'] == 500
    wire.feed(list(range(1000, 1010)))
    assert len(wire.found) == 1010


def test_a_number_far_off_moves_nothing():
    """A counter of 2^62 must not make all that follows look old."""
    wire = Wire().feed(list(range(100)))
    for wild in (2**62, -(2**62), 10**9, 5_000):
        wire.feed([wild])
    wire.feed(list(range(100, 200)))
    assert wire.found == [(i, float(i)) for i in range(200)]
    assert wire.counts['implausible'] == 4


def test_a_silence_is_a_gap_of_its_length():
    wire = Wire().feed(list(range(100)))
    wire.now += 60.0
    wire.feed(list(range(60_000, 60_010))).end()
    assert wire.counts['lost'] == 59_900 and not wire.counts['restarts']
    assert wire.found[100] == (60_000, 60_000.0)


@given(
    numbers=st.lists(st.integers(-(2**63), 2**63 - 1) | st.integers(0, 600), max_size=300),
    modulus=st.sampled_from([None, 256, 65_536]),
)
def test_no_counter_breaks_order_or_fills_memory(numbers, modulus):
    wire = Wire(modulus)
    for number in numbers:
        row = np.array([[float(number % 1000)]])
        sent = number % modulus if modulus else number
        wire.now += 1e-3
        wire.take(wire.sequence.push(np.array([sent], dtype=np.int64), row, wire.now))
        assert len(wire.sequence._held) <= HOLD_SAMPLES + 1
        assert len(wire.sequence._lost) <= 4096
    wire.end()
    handed = len(wire.found) + wire.counts['duplicates'] + wire.counts['late']
    # Each sample is handed on, or counted for why not, or still doubted.
    left = len(wire.sequence._candidates)
    assert handed + wire.counts['implausible'] + left == len(numbers)
    indices = [i for i, _ in wire.found]
    if wire.began <= 1:
        assert indices == sorted(set(indices))


@pytest.mark.parametrize('modulus', [None, 256])
@pytest.mark.parametrize(
    ('first', 'reordered'),
    [([5, 3, 4], 2), ([4, 3], 1), ([9, 8, 7, 6, 5, 4, 3], 6), ([3, 4, 5], 0)],
)
def test_the_first_samples_are_put_right_as_all_others(modulus, first, reordered):
    """What comes out of order at the very beginning is neither lost nor told as repeated."""
    begin = 250 if modulus else 0
    rest = range(max(first) + 1, 300)
    wire = Wire(modulus).feed([begin + n for n in (*first, *rest)]).end()
    assert wire.found == [(i, begin + 3.0 + i) for i in range(297)]
    assert +wire.counts == Counter(reordered=reordered) + Counter()


def test_a_number_far_off_at_the_beginning_begins_nothing():
    wire = Wire().feed([10**9, *range(100)]).end()
    assert wire.found == [(i, float(i)) for i in range(100)]
    assert +wire.counts == Counter(implausible=1)


def test_what_is_older_than_the_first_sample_is_late_and_not_repeated():
    wire = Wire().feed(range(5, 85))
    wire.feed([4])
    assert +wire.counts == Counter(late=1)
    assert wire.found == [(i, 5.0 + i) for i in range(80)]
