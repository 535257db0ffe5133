"""Samples in order with their stamps, and a declared rate that clocks contradict."""

from itertools import pairwise

import numpy as np
import pytest
from streaming import layout

from actuator_glue.streams.layout import PLAIN, Rows
from actuator_glue.streams.reception import Reception

START = 1_700_000_000 * 10**9
BARE = layout([{'name': 'command', 'unit': 'm'}, {'name': 'measured', 'unit': 'm'}])
TIMED = layout(
    [
        {'name': 'time', 'unit': 's'},
        {'name': 'command', 'unit': 'm'},
        {'name': 'measured', 'unit': 'm'},
    ]
)
PACKETS = layout(
    [{'name': 'command', 'unit': 'm'}, {'name': 'measured', 'unit': 'm'}],
    packet=[{'name': 'time', 'unit': 's'}],
    samples=4,
)


def fed(reception, seconds, *, true=1000.0, clock=1.0, block=10, counter=True, time=True, late=()):
    """Samples of a stream, block by block.

    `true` is its rate, the sender's time runs `clock` times as fast as the receiver's, and `late`
    is how much later [s] than it was sent each block arrives.
    """
    found = []
    for number, first in enumerate(range(0, int(seconds * true), block)):
        index = np.arange(first, first + block)
        values = 1e-3 * np.sin(0.01 * index)
        now = (first + block) / true + (late[number] if number < len(late) else 0.0)
        rows = Rows(
            values,
            values,
            None,
            index if counter else None,
            clock * index / true if time else None,
            START + round(now * 1e9),
        )
        found += reception.push(rows, now)
    return found


@pytest.mark.parametrize(
    ('its', 'given', 'in_order'),
    [
        (PLAIN, {}, False),
        (PLAIN, {'time': False}, False),
        (BARE, {'counter': False}, True),
        (BARE, {'counter': False, 'time': False}, True),
    ],
    ids=['counter and time', 'counter', 'time', 'neither'],
)
@pytest.mark.parametrize('true', [500.0, 985.0, 1000.0, 1008.0, 2000.0])
def test_another_sample_rate_than_declared_is_told(its, given, in_order, true):
    """By the sender's time within seconds, by the arrivals where there is none."""
    reception = Reception(its, 1000.0, in_order=in_order)
    fed(reception, 12.0, true=true, **given)
    if true in (1000.0, 1008.0):
        assert reception.rate_fault == ''
        return
    assert reception.rate_fault.startswith('the sample rate is said to be 1000 Hz, but by ')
    assert f'by the arrival of the samples it is {true:.4g} Hz' in reception.rate_fault
    known = given.get('time', True)
    assert (f"by the sender's time it is {true:.4g} Hz" in reception.rate_fault) == known


@pytest.mark.parametrize('true', [500.0, 1000.0, 2000.0])
@pytest.mark.parametrize('its', [PLAIN, PACKETS], ids=['each', 'packets of four'])
def test_times_that_order_samples_tell_their_rate(its, true):
    """Numbers rounded from the times agree with any rate; the steps of the times do not."""
    plain = layout(
        [
            {'name': 'time', 'unit': 's'},
            {'name': 'command', 'unit': 'm'},
            {'name': 'measured', 'unit': 'm'},
        ]
    )
    reception = Reception(plain if its is PLAIN else its, 1000.0)
    assert reception.order == 'time'
    fed(reception, 9.0, true=true, block=4, counter=False)
    told = f"by the sender's time it is {true:.4g} Hz" in reception.rate_fault
    assert told == (true != 1000.0)


def test_a_sender_whose_time_is_in_another_unit_is_told():
    """Milliseconds that the layout calls seconds."""
    reception = Reception(PLAIN, 1000.0)
    fed(reception, 4.0, clock=1000.0)
    assert "by the sender's time it is 1 Hz" in reception.rate_fault


def test_a_rate_that_agrees_again_is_told_no_more():
    reception = Reception(PLAIN, 1000.0)
    fed(reception, 4.0, true=500.0)
    assert reception.rate_fault
    for first in range(2000, 8000, 10):
        index = np.arange(first, first + 10)
        values = np.zeros(10)
        now = 4.0 + (first - 1990) * 1e-3
        time = 4.0 + (index - 2000) * 1e-3
        reception.push(Rows(values, values, None, index, time, START + round(now * 1e9)), now)
    assert reception.rate_fault == ''


def test_arrivals_that_are_held_up_are_no_other_rate(rng_seed):
    """A receiver that stalls for a second and catches up, and blocks up to 8 ms late."""
    late = np.random.default_rng(rng_seed).exponential(2e-3, 3000)
    late[800:900] += np.linspace(1.0, 0.0, 100)
    reception = Reception(PLAIN, 1000.0)
    sent = 0.01 * np.arange(3000)
    fed(reception, 30.0, time=False, late=np.maximum.accumulate(sent + late) - sent)
    assert reception.rate_fault == ''


@pytest.mark.parametrize('block', [1, 10, 25, 100])
@pytest.mark.parametrize('held', [0.02, 0.3])
def test_stamps_never_go_back(block, held, rng_seed):
    """The last of a block is before the first of the next, also where the first were held up."""
    blocks = 4000 // block
    late = np.random.default_rng(rng_seed).exponential(2e-4, blocks)
    late[: max(1, 40 // block)] += held
    reception = Reception(PLAIN, 1000.0)
    found = fed(reception, 4.0, block=block, late=late)
    assert sum(len(s.command) for s in found) > 3900
    edges = [(s.stamp_ns, s.stamp_ns + (len(s.command) - 1) * 1_000_000) for s in found]
    for (_, last), (first, _) in pairwise(edges):
        assert first > last


def by_time_alone(times, rate=1000.0):
    """What comes of single samples whose times [s] alone tell their order, each 1 ms later."""
    reception, found = Reception(TIMED, rate), []
    for i, time in enumerate(times.tolist()):
        value = np.array([1e-6 * i])
        rows = Rows(value, value, None, None, np.array([time]), START + i * 10**6)
        found += reception.push(rows, i * 1e-3)
    found += reception.waited(len(times), START + len(times) * 10**6)
    command = np.concatenate([s.command for s in found])
    index = np.concatenate([s.index + np.arange(len(s.command)) for s in found])
    return reception.counts, index, np.rint(1e6 * command).astype(int)


PHASES = 0.0, 0.25, 0.5, 0.77
CLOCKS = (0.0, 0.0), (0.0, 0.1), (5e-5, 0.05), (-2e-3, 0.0)


@pytest.mark.parametrize(
    ('phase', 'drift', 'jitter', 'epoch'),
    [  # each phase with each clock; each of both from both epochs
        (phase, *clock, (0.0, 1.7e9)[(i + j) % 2])
        for i, phase in enumerate(PHASES)
        for j, clock in enumerate(CLOCKS)
    ],
)
def test_times_need_not_be_multiples_of_the_period(phase, drift, jitter, epoch):
    """Where they lie half between, each second sample was taken for a repeated one."""
    order = np.arange(2000)
    order[[500, 501, 1500, 1501]] = [501, 500, 1501, 1500]
    lie = (1.0 + drift) * order + phase
    lie += jitter * np.random.default_rng(5).standard_normal(len(order))
    counts, index, command = by_time_alone(epoch + lie / 1000.0)
    assert +counts == {'reordered': 2}
    assert np.array_equal(index, np.arange(2000)) and np.array_equal(order[command], index)


def test_times_tell_what_is_lost_repeated_and_far_off():
    taken = np.delete(np.arange(3000), slice(1000, 1007))
    lie = np.insert(taken + 0.5, 2000, [1e9, taken[1999] + 0.5])
    counts, index, command = by_time_alone(lie / 1000.0)
    assert +counts == {'lost': 7, 'implausible': 1, 'duplicates': 1}
    assert np.array_equal(index, taken) and len(command) == len(taken)


def in_order(times, size, rate=1000.0):
    """Indices that come of samples in order with times [s], so many of them at once."""
    reception, found = Reception(TIMED, rate, in_order=True), []
    for first in range(0, len(times), size):
        part = np.asarray(times[first : first + size], dtype=np.float64)
        arrived = float(part[-1])
        rows = Rows(part, part, None, None, part, START + round(arrived * 1e9))
        found += reception.push(rows, arrived)
        found += reception.waited(arrived, START + round(arrived * 1e9))
    return reception, np.concatenate([s.index + np.arange(len(s.command)) for s in found])


@pytest.mark.parametrize('size', [1, 20, 64, 1000])
def test_a_gap_is_one_however_lines_arrive(size):
    """Within what a socket hands over at once it was none, or a clock that was set."""
    taken = np.delete(np.arange(12_000), [*range(3010, 3510), *range(4000, 9000)])
    reception, index = in_order(taken / 1000.0, size)
    assert np.array_equal(index, taken) and +reception.counts == {'lost': 5500}
    assert reception.rate_fault == ''


@pytest.mark.parametrize(
    ('size', 'step'),
    [(1, 0.05), (1, 1.0), *((n, s) for n in (20, 64, 1000) for s in (0.05, 0.1, 1.0))],
)
def test_times_of_few_digits_are_no_gaps(size, step):
    """A text of whole seconds: half of such a stream was said to be lost."""
    counted = np.arange(300, 6300)
    reception, index = in_order(np.floor(counted / 1000.0 / step) * step, size)
    assert np.array_equal(index, np.arange(6000)) and not +reception.counts
    gap = np.where(counted < 3100, counted, counted + 3000)
    reception, index = in_order(np.floor(gap / 1000.0 / step) * step, size)
    assert abs(reception.counts['lost'] - 3000) <= 1000.0 * step
    assert len(index) == 6000


@pytest.mark.parametrize('size', [1, 20, 64])
def test_times_in_another_unit_are_another_rate_and_no_gaps(size):
    reception, index = in_order(np.arange(1000.0), size)
    assert np.array_equal(index, np.arange(1000)) and not reception.counts['lost']
    assert 'by the sender' in reception.rate_fault


def test_a_time_that_is_no_number_drops_no_sample():
    """The counter tells the order: such samples are kept, counted, and stamped by the others."""
    table = np.zeros((300, 5))
    table[:, 0] = np.arange(300)
    table[:, 1] = 50.0 + np.arange(300) / 100.0
    table[100:200, 1] = np.nan
    reception, found, untimed = Reception(PLAIN, 100.0), [], 0
    for row in table:
        values = dict(zip(PLAIN.fields, row[:, None], strict=True))
        rows, faults = PLAIN.rows(values, START + round(row[0] * 1e7), 100.0)
        untimed += faults['untimed']
        assert not faults['malformed']
        found += reception.push(rows, row[0] / 100.0)
    assert untimed == 100
    stamps = np.concatenate([s.stamp_ns + np.arange(len(s.command)) * 10_000_000 for s in found])
    assert len(stamps) > 290
    np.testing.assert_allclose(
        (stamps - stamps[0]) * 1e-9, np.arange(len(stamps)) / 100, atol=0.06
    )


@pytest.mark.parametrize('moved', [-1.5, -3600.0, 3600.0])
@pytest.mark.parametrize('block', [1, 10, 64])
def test_a_clock_that_is_set_under_a_running_counter_is_told(moved, block):
    """No stamp is off by what it was set; it is counted once, and no sample is lost."""
    reception, found = Reception(PLAIN, 200.0), []
    for first in range(0, 900, block):
        index = np.arange(first, first + block)
        time = index / 200.0 + np.where(index >= 301, moved, 0.0)
        values = 1e-3 * np.sin(0.1 * index)
        now = (first + block) / 200.0
        rows = Rows(values, values, None, index, time, START + round(now * 1e9))
        found += reception.push(rows, now)
    assert reception.counts['clock set'] == 1
    assert not reception.counts['lost'] and not reception.counts['restarts']
    index = np.concatenate([s.index + np.arange(len(s.command)) for s in found])
    stamps = np.concatenate([s.stamp_ns + np.arange(len(s.command)) * 5_000_000 for s in found])
    np.testing.assert_array_equal(index, np.arange(len(index)))
    off = (stamps - START) * 1e-9 - index / 200.0
    assert np.abs(off).max() < 0.4  # a block, not what the clock was set by


def test_a_time_in_whole_seconds_is_no_clock_that_is_set():
    """It stands still and goes on by one: that is how coarse it is."""
    reception = Reception(PLAIN, 200.0)
    index = np.arange(2000)
    for first in range(0, 2000, 10):
        part = index[first : first + 10]
        values = np.zeros(10)
        arrival = START + round(part[-1] * 5e6)
        rows = Rows(values, values, None, part, np.floor(part / 200.0), arrival)
        reception.push(rows, part[-1] / 200.0)
    assert not reception.counts['clock set']
