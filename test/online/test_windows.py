"""Windows: which samples they hold, and what restarts them."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from online_streams import RATE, block, setup

from actuator_glue.errors import InputError
from actuator_glue.online.settings import EstimatorSettings
from actuator_glue.online.stream import Rejected, Restarted
from actuator_glue.online.windows import SlidingWindows, Tail, WrongRate
from actuator_glue.records import same_period
from actuator_glue.sample_block import MAX_BLOCK, Block

SETTINGS = EstimatorSettings(window=0.5, hop=0.2, settle=0.0, time_budget=0.1)
WINDOW, HOP = 100, 40


def run(blocks, settings=SETTINGS, setups=()):
    """Push set-ups, then blocks; return windows and events."""
    windows = SlidingWindows(settings)
    events, found = [], []
    for announced in setups or (setup(),):
        events += windows.setup(announced)
    for one in blocks:
        told, complete = windows.push(one)
        events += told
        found += complete
    return found, events, windows


def cut(sizes, start=0):
    """Blocks of the given sizes, one after the other."""
    index = start
    for size in sizes:
        yield block(index, size)
        index += size


@given(st.lists(st.integers(1, 137), min_size=1, max_size=40), st.integers(0, 500))
def test_windows_do_not_depend_on_how_the_stream_is_cut(sizes, start):
    found, _, _ = run(cut(sizes, start))
    whole, _, _ = run([block(start, sum(sizes))])
    assert [w.record.first_index for w in found] == [w.record.first_index for w in whole]
    for one, other in zip(found, whole, strict=True):
        assert np.array_equal(one.record.command, other.record.command)
        assert one.record.start_ns == pytest.approx(other.record.start_ns, abs=1)


@given(st.lists(st.integers(1, 60), min_size=1, max_size=60), st.integers(0, 500))
def test_windows_hold_the_last_samples_and_end_at_multiples_of_the_hop(sizes, start):
    found, _, _ = run(cut(sizes, start))
    stop = start + sum(sizes)
    ends = [e for e in range(start + WINDOW, stop + 1) if e % HOP == 0]
    assert [w.end for w in found] == ends
    for window in found:
        first = window.record.first_index
        assert np.array_equal(window.record.command, 1e-6 * np.arange(first, first + WINDOW))


@given(
    st.lists(
        st.tuples(st.integers(1, 50), st.sampled_from(['ok', 'gap', 'nan', 'empty', 'back'])),
        min_size=1,
        max_size=60,
    )
)
def test_no_window_holds_a_gap_or_a_bad_sample(pieces):
    index, blocks = 0, []
    for size, kind in pieces:
        if kind == 'gap':
            index += 7
        if kind == 'back':
            index = max(0, index - 90)
        if kind == 'empty':
            blocks.append(block(index, 0))
            continue
        one = block(index, size)
        if kind == 'nan':
            one.measured[size // 2] = np.nan
        blocks.append(one)
        index += size
    found, _, windows = run(blocks)
    for window in found:
        first = window.record.first_index
        assert np.array_equal(window.record.command, 1e-6 * np.arange(first, first + WINDOW))
        assert np.isfinite(window.record.measured).all()
    kinds = [kind for _, kind in pieces]
    assert windows.tally.rejected == kinds.count('nan') + kinds.count('empty')


@given(st.lists(st.integers(1, 30), min_size=1, max_size=200))
def test_memory_is_bounded_by_the_window(sizes):
    tail = Tail(50)
    seen = np.empty(0)
    for size in sizes:
        values = np.arange(len(seen), len(seen) + size, dtype=float)
        seen = np.concatenate([seen, values])
        tail.append(Block(0, 0.01, 0, values, -values, 2.0 * values))
    count = min(len(seen), 50)
    assert len(tail) == count and tail._data.size == 6 * 50
    command, measured, force = tail.last(count)
    assert np.array_equal(force, 2.0 * seen[-count:])
    assert np.array_equal(command, seen[-count:]) and np.array_equal(measured, -seen[-count:])


def test_a_gap_restarts_and_says_how_much_is_missing():
    found, events, windows = run([block(0, 100), block(150, 100)])
    assert windows.tally.lost == 50 and windows.tally.gaps == 1
    (gap,) = [e for e in events if isinstance(e, Restarted) and e.reason == 'gap']
    assert '50 samples are missing before sample 150' in gap.message
    assert [w.record.first_index for w in found] == []


def test_a_stream_that_begins_again_restarts():
    _, events, _ = run([block(0, 100), block(100, 10), block(0, 100)])
    assert [e.reason for e in events if isinstance(e, Restarted)] == ['setup', 'stream']


@pytest.mark.parametrize(
    ('step', 'told'), [(0.0, False), (0.01, False), (0.5, True), (-0.05, False), (-5.0, True)]
)
def test_a_jump_of_the_clock_restarts(step, told):
    stamp = 10**18 + round((100 / RATE + step) * 1e9)
    _, events, _ = run([block(0, 100), block(100, 100, stamp_ns=stamp)])
    assert any(isinstance(e, Restarted) and e.reason == 'clock' for e in events) == told


def test_equal_stamps_are_a_clock_that_stands():
    _, events, _ = run([block(0, 1), block(1, 1, stamp_ns=10**18)])
    assert [e.reason for e in events if isinstance(e, Restarted)] == ['setup', 'clock']


@pytest.mark.parametrize(
    ('channels', 'told'),
    [
        ({'measured': np.array([0.0, np.nan, 0.0])}, 'measured is NaN or infinite at sample 41'),
        ({'command': np.array([np.inf, 0.0, 0.0])}, 'command is NaN or infinite at sample 40'),
        ({'measured': np.array([0.0, 1e6, 0.0])}, 'beyond 10 m; check the unit'),
        ({'measured': np.zeros(2)}, 'different lengths'),
        ({'force': np.array([0.0, 0.0, 1e12])}, 'force is 1e+12 N at sample 42'),
        ({'period': np.nan}, 'period nan s is outside'),
        ({'period': -0.001}, 'is outside [1e-6, 10] s'),
        ({'period': 0.01}, 'but the test set-up says 200 Hz'),
    ],
)
def test_unusable_blocks_are_rejected_and_say_why(channels, told):
    found, events, windows = run([block(0, 40), block(40, 3, **channels), block(43, 200)])
    (rejected,) = [e for e in events if isinstance(e, Rejected)]
    assert told in rejected.message and 'sample 40' in rejected.message
    # The stream goes on with the next block; nothing before it is used.
    assert found and all(w.record.first_index >= 43 for w in found)
    assert windows.tally.lost == 0


def test_absurd_blocks_are_rejected():
    for one, told in (
        (block(-1, 3), 'index'),
        (block(2**63, 3), 'index'),
        (block(0, MAX_BLOCK + 1), 'samples are more than'),
        (block(0, 0), 'it is empty'),
    ):
        _, events, _ = run([one])
        assert [told in e.message for e in events if isinstance(e, Rejected)] == [True]


def test_one_sample_at_a_time_is_fine():
    found, events, _ = run(cut([1] * 200))
    assert [w.end for w in found] == [120, 160, 200]
    assert not [e for e in events if isinstance(e, Rejected)]


def test_a_set_up_holds_from_its_sample_on():
    found, events, _ = run([block(0, 400)], setups=(setup(0.0), setup(250e3, index=170)))
    assert [(w.end, w.record.stiffness) for w in found] == [
        (120, 0.0),
        (160, 0.0),
        (280, 250e3),
        (320, 250e3),
        (360, 250e3),
        (400, 250e3),
    ]
    assert [e.index for e in events if isinstance(e, Restarted)] == [0, 170]


def test_the_same_set_up_again_changes_nothing():
    found, events, _ = run([block(0, 200)], setups=(setup(), setup(index=55)))
    assert [w.end for w in found] == [120, 160, 200]
    assert len([e for e in events if isinstance(e, Restarted)]) == 1


def test_without_a_known_stiffness_there_are_no_windows():
    found, events, _ = run([block(0, 400)], setups=(setup(None),))
    assert not found
    assert 'specimen stiffness unknown' in events[0].message


def test_before_any_set_up_there_are_no_windows():
    windows = SlidingWindows(SETTINGS)
    assert windows.push(block(0, 400)) == ([], [])
    windows.setup(setup())
    _, found = windows.push(block(400, 200))
    assert [w.record.first_index for w in found] == [420, 460, 500]


def stiffnesses(found):
    """Return first and last sample of the windows under each stiffness, in their order."""
    spans = []
    for window in found:
        record = window.record
        last = record.first_index + len(record) - 1
        if spans and spans[-1][0] == record.stiffness and spans[-1][2] < last:
            spans[-1][2] = last
        else:
            spans.append([record.stiffness, record.first_index, last])
    return [tuple(span) for span in spans]


ONCE = [(0.0, 20, 399), (250e3, 420, 799)]
PAIR = (setup(0.0), setup(250e3, index=400))


@pytest.mark.parametrize('late', [0, 1])
@pytest.mark.parametrize('stop', [300, 800])
@pytest.mark.parametrize('order', [PAIR, PAIR[::-1]])
def test_set_ups_of_a_stream_that_begins_again_hold_where_they_say(order, stop, late):
    """Announced between the two, or just before the last block of the first; in any order."""
    windows = SlidingWindows(SETTINGS)
    for announced in PAIR:
        windows.setup(announced)
    first = list(cut([20] * (stop // 20)))
    for one in first[: len(first) - late]:
        windows.push(one)
    for announced in order:
        windows.setup(announced)
    for one in first[len(first) - late :]:
        windows.push(one)
    found, events = [], []
    for one in cut([20] * 40):
        told, complete = windows.push(one)
        events += told
        found += complete
    assert stiffnesses(found) == ONCE
    assert {e.index for e in events if isinstance(e, Restarted)} == {0, 400}


def test_what_was_announced_for_the_old_numbers_is_forgotten():
    windows = SlidingWindows(SETTINGS)
    for announced in PAIR:
        windows.setup(announced)
    for one in cut([20] * 10):
        windows.push(one)
    windows.setup(setup(1e3, index=600))
    windows.push(block(0, 20))
    found = [w for one in cut([20] * 39, start=20) for w in windows.push(one)[1]]
    assert stiffnesses(found) == [(0.0, 20, 799)]


@pytest.mark.parametrize('size', [20, 30])
def test_a_rate_that_is_announced_ahead_holds_from_its_sample(size):
    """A block across it has one period, which is wrong for a part of it: it is told and left."""
    fast = 0.5 / RATE
    windows = SlidingWindows(SETTINGS)
    for announced in (setup(), setup(index=400, period=fast)):
        windows.setup(announced)
    found, events, stamp = [], [], 10**18
    for index in range(0, 1600, size):
        period = 1.0 / RATE if index < 400 else fast
        told, complete = windows.push(block(index, size, period, stamp))
        stamp += round(size * period * 1e9)
        found += complete
        events += told
    rejected = [e for e in events if isinstance(e, Rejected)]
    assert [e.message[:20] for e in rejected] == ['block at sample 390:'] * (size == 30)
    assert {w.record.period for w in found if w.end <= 400} == {1.0 / RATE}
    assert {w.record.period for w in found if w.end > 400} == {fast}
    assert len([w for w in found if w.end > 400]) > 10


def test_announced_set_ups_are_bounded():
    windows = SlidingWindows(SETTINGS)
    windows.setup(setup())
    windows.push(block(0, 10))
    for index in range(100, 5100):
        windows.setup(setup(index=index))
    assert len(windows._setups._announced) <= 1000
    assert len(windows._setups._lately) <= 1000


@pytest.mark.parametrize(
    ('values', 'told'),
    [
        ({'stiffness': -1.0}, 'specimen stiffness -1 N/m is outside'),
        ({'stiffness': np.nan}, 'specimen stiffness is nan'),
        ({'period': 0.0}, 'sample period 0 s'),
        ({'hold': 'cubic'}, "use 'zoh' or 'linear'"),
        ({'index': -3}, 'running index -3'),
    ],
)
def test_unusable_set_ups_say_why(values, told):
    with pytest.raises(InputError) as error:
        setup(**values)
    assert told in str(error.value)


@pytest.mark.parametrize(
    ('values', 'told'),
    [
        ({'window': -1.0}, 'window = -1 is outside'),
        ({'hop': 6.0}, 'longer than the window'),
        ({'settle': 4.9}, 'less than a fifth'),
        ({'time_budget': 2.0}, 'windows would pile up'),
        ({'levels': (0.9, 0.5)}, 'must ascend'),
        ({'levels': ()}, 'between 0 and 1'),
        ({'levels': (1.0,)}, 'between 0 and 1'),
        ({'shaping_factor': np.nan}, 'shaping_factor = nan'),
        ({'likelihood': 'ols'}, 'use one of glue, gaussian'),
    ],
)
def test_unusable_settings_say_why(values, told):
    with pytest.raises(InputError) as error:
        EstimatorSettings(**values)
    assert told in str(error.value)


def stamped(rate, seconds, *, start=0, jitter=0.0, size=10):
    """Blocks that say 200 Hz, with the stamps of samples taken at another rate."""
    rng = np.random.default_rng(3)
    for index in range(start, start + round(rate * seconds), size):
        late = abs(jitter * rng.standard_normal())
        yield block(index, size, stamp_ns=10**18 + round((index / rate + late) * 1e9))


@pytest.mark.parametrize('rate', [100.0, 197.0, 203.0, 400.0])
def test_stamps_that_tell_another_rate_give_no_window(rate):
    """`rate:=500` for samples at 1 kHz was a posterior of half the beta_1, and all was well."""
    settings = EstimatorSettings(window=3.0, hop=0.5, settle=0.0, time_budget=0.1)
    found, events, windows = run(stamped(rate, 12.0, jitter=2e-3), settings)
    told = [e for e in events if isinstance(e, WrongRate)]
    assert not found and told
    assert f'said to be {RATE:g} Hz' in told[0].message
    number = float(told[0].message.partition('it is ')[2].partition(' Hz')[0])
    assert number == pytest.approx(rate, rel=0.004)
    assert windows.tally.rejected == len(told) and windows.tally.lost == 0


@pytest.mark.parametrize('rate', [199.0, 201.0])
def test_a_clock_that_drifts_or_jitters_is_no_other_rate(rate):
    settings = EstimatorSettings(window=3.0, hop=0.5, settle=0.0, time_budget=0.1)
    found, events, _ = run(stamped(rate, 12.0, jitter=5e-3), settings)
    assert len(found) > 15 and not [e for e in events if isinstance(e, Rejected)]


def test_windows_come_again_when_the_rate_is_mended():
    """The same numbering goes on, and what was refused is not said to be lost."""
    settings = EstimatorSettings(window=2.5, hop=0.5, settle=0.0, time_budget=0.1)
    wrong = list(stamped(400.0, 5.0))
    stop = wrong[-1].index + len(wrong[-1])
    begin = wrong[-1].stamp_ns
    right = [
        block(i, 10, stamp_ns=begin + round((i - stop + 1) / RATE * 1e9))
        for i in range(stop, stop + 4000, 10)
    ]
    found, events, windows = run([*wrong, *right], settings)
    assert isinstance(events[1], WrongRate)
    assert found and found[0].record.first_index >= stop
    assert windows.tally.lost == 0


@pytest.mark.parametrize('apart', [1e-9, 3e-5])
def test_periods_that_are_one_to_any_purpose_are_one(apart):
    """The last digits of a clock: neither the blocks nor set-ups of one test are others."""
    rng = np.random.default_rng(2)
    jittered = [
        replace(one, period=one.period * (1.0 + apart * rng.uniform(-1.0, 1.0)))
        for one in cut([50] * 20)
    ]
    again = replace(setup(index=500), period=setup().period * (1.0 + apart))
    found, events, _ = run(jittered, setups=(setup(), again))
    assert [w.end for w in found] == [w.end for w in run(cut([50] * 20))[0]]
    assert len(events) == 1 and isinstance(events[0], Restarted)


def test_what_is_no_period_is_not_the_same():
    """NaN, zero, and a share more than the tolerance; rates are compared like periods."""
    assert same_period(0.005, 0.005 * (1.0 + 9e-5)) and same_period(200.0, 200.01)
    for one, other in ((0.005, 0.005001), (np.nan, 0.005), (np.nan, np.nan), (0.0, 0.005)):
        assert not same_period(one, other) and not same_period(other, one)


def test_the_set_up_that_governs_the_samples_says_whether_they_are_used():
    """Neither one that has passed nor one announced for later is what holds now."""
    windows = SlidingWindows(SETTINGS)
    windows.setup(setup(stiffness=None))
    windows.setup(setup(index=1000))
    assert windows.unused == ''  # no sample has come
    windows.push(block(4000, 100))
    assert windows.unused == ''
    windows.setup(setup(stiffness=None, index=8000))
    windows.push(block(4100, 100))
    assert windows.unused == ''
    windows.setup(setup(stiffness=None, index=4200))
    windows.push(block(4200, 100))
    assert windows.unused == "the specimen stiffness of 'actuator' is not known"
    windows.setup(setup(index=4300))
    windows.push(block(4300, 100))
    assert windows.unused == ''


def test_samples_before_any_set_up_are_said_to_lack_it():
    windows = SlidingWindows(SETTINGS)
    windows.push(block(0, 100))
    assert windows.unused == 'samples arrive, but nothing on test_setup yet'
