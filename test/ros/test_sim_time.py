"""use_sim_time: a /clock that runs, stands still and jumps; the streams keep to it."""

import threading
import time
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
from actuator_glue_msgs.msg import SampleBlock
from rclpy.duration import Duration
from rclpy.qos import QoSProfile
from ros_nodes import RATE, Timekeeper, recorded

from actuator_glue.io.bag_reader import decoded, messages
from actuator_glue.nodes import actuator_sim, lab_file
from actuator_glue.nodes.health import Rate
from actuator_glue.nodes.pacer import Pacer, Step
from actuator_glue.records import Record

BLOCK = 10 / RATE  # what one message holds [s]


@pytest.fixture
def clock(probe):
    keeper = Timekeeper(probe)
    yield keeper
    keeper.end()


def stamps(blocks):
    return np.array([m.header.stamp.sec + 1e-9 * m.header.stamp.nanosec for m in blocks])


@pytest.mark.parametrize(
    'node', ['actuator_sim', pytest.param('lab_bridge', marks=pytest.mark.slow)]
)
def test_a_stream_runs_pauses_and_jumps_with_the_clock(node, start, probe, clock, tmp_path):
    blocks = []
    probe.create_subscription(SampleBlock, 'samples', blocks.append, QoSProfile(depth=1000))
    given = {'rate': RATE, 'duration': 600.0}
    if node == 'lab_bridge':
        seconds = np.arange(round(600 * RATE)) / RATE
        file = tmp_path / 'test.csv'
        table = np.column_stack([seconds, np.sin(seconds), np.sin(seconds - 0.02)])
        np.savetxt(file, table, delimiter=',', header='time_s,command_mm,measured_mm', comments='')
        given = {'file': str(file), 'specimen_stiffness': 1e5}
    process = start(node, use_sim_time=True, wait_for=1, diagnostics_period=0.1, **given)
    probe.until(lambda: len(blocks) > 40, what='samples')

    def stands():
        """The clock stands still: what was due leaves, however long that takes, and no more."""
        now = clock.stand_still()

        def late():
            return abs(stamps(blocks[-1:])[0] - now)

        probe.until(lambda: late() < 2.5 * BLOCK, what='what was due')
        found = len(blocks)
        probe.for_a_while(0.5)
        assert len(blocks) <= found + 1 and late() < 2.5 * BLOCK
        return len(blocks), now

    def runs(speed, jump=0.0):
        """A second of the clock is a second of samples, wherever the clock jumps before."""
        before, then = stands()
        clock.jump(jump)
        if jump:
            # It goes on when that is known: a node that is held up meanwhile takes all for a jump.
            probe.until(lambda: abs(probe.stamps[node] - clock.now) < 1.0, what='a jump is seen')
            probe.for_reports(node, 3)
        clock.speed = speed
        probe.until(lambda: clock.now > then + jump + 1.0, what='the clock')
        after, now = stands()
        assert abs((after - before) * BLOCK - (now - then - jump)) < 3 * BLOCK

    runs(1.0)
    runs(2.0)
    # Ahead and back: no sample is left out, none is made in a hurry.
    runs(1.0, 500.0)
    runs(1.0, -700.0)
    index = np.concatenate([np.arange(m.index, m.index + len(m.command)) for m in blocks])
    assert np.array_equal(index, np.arange(index[0], index[0] + len(index)))
    steps = np.diff(stamps(blocks))
    assert (np.abs(steps - BLOCK) > 0.2).sum() == 2
    assert process.alive and process.end() == 0, process.text


class Blocks:
    """Where a stream's samples go: the start of its clock and the samples that follow it."""

    def __init__(self):
        self.start = self.samples = lambda *_: None

    def begin(self, actuator, period, start_ns, first_index=0):
        self.start = start_ns, first_index


def test_after_a_jump_the_last_sample_of_a_block_is_the_newest():
    """A block leaves when its last sample has been taken; stamps began at its first one."""
    now = SimpleNamespace(now=lambda: SimpleNamespace(nanoseconds=10**12))
    plant = SimpleNamespace(step=lambda command: (command, command))
    simulator = SimpleNamespace(
        get_clock=lambda: now, out=Blocks(), plant=plant, samples=Rate(), _index=40
    )
    simulator._values = {'rate': RATE, 'actuator': 'rig'}
    simulator._clock_changed, simulator._renewed = True, False
    simulator._publish_preview = lambda: None
    simulator._start_clock = partial(actuator_sim.SimulatorNode._start_clock, simulator)
    actuator_sim.SimulatorNode._publish(simulator, np.zeros(10))
    record = Record(np.zeros(100), np.zeros(100), 1.0 / RATE, 1e5)
    file = SimpleNamespace(_node=simulator, _out=Blocks(), _clock_changed=True)
    file._start_clock = partial(lab_file.FileSource._start_clock, file)
    lab_file.FileSource._publish(file, record, 40, 50, 0)
    assert simulator.out.start == file._out.start == (10**12 - round(BLOCK * 1e9), 40)


def test_what_comes_before_the_clock_is_recorded_at_its_first_time(start, probe, tmp_path):
    """Log times of 1970 would put hours between a set-up and its samples."""
    bag = tmp_path / 'bag'
    recorder = start('recorder', use_sim_time=True, bag=str(bag))
    probe.until(lambda: probe.value('recorder', 'state') == 'active')
    probe.open_stream()
    probe.setup()
    for _ in range(20):
        probe.block(np.zeros(20), np.zeros(20))
    probe.until(lambda: 'wait in memory for the first /clock' in probe.faults['recorder'])
    keeper = Timekeeper(probe)
    probe.until(lambda: probe.number('recorder', 'messages written') > 20, what='it goes on')
    probe.block(np.zeros(20), np.zeros(20))
    probe.until_recorded(bag, 420)
    assert recorder.end() == 0, recorder.text
    keeper.end()
    assert np.array_equal(recorded(bag), np.arange(420))
    logged = np.array([m.log_time for m in messages(bag)]) * 1e-9
    assert logged.min() >= 1000.0 and logged.max() <= keeper.now
    assert 'messages came before the first /clock' in recorder.text
    # What the recorder says of itself has a stamp, too, and tells whose.
    reports = [m for _, m in decoded(bag, ('DiagnosticArray',))]
    said = np.array([m.header.stamp.sec for m in reports])
    assert (said >= 1000).all()
    assert "computer's time" in probe.faults['recorder']


def test_where_the_clock_never_comes_the_computers_time_is_taken_and_told(start, probe, tmp_path):
    bag = tmp_path / 'bag'
    recorder = start('recorder', use_sim_time=True, bag=str(bag))
    probe.until(lambda: probe.value('recorder', 'state') == 'active')
    probe.open_stream()
    probe.setup()
    probe.block(np.zeros(20), np.zeros(20))
    # A busy recorder may tell of the set-up before it has the block.
    assert probe.samples_out.wait_for_all_acked(Duration(seconds=60.0))
    probe.faults.clear()
    probe.until(lambda: 'wait in memory for the first /clock' in probe.faults['recorder'])
    assert recorder.end() == 0, recorder.text
    assert np.array_equal(recorded(bag), np.arange(20))
    logged = np.array([m.log_time for m in messages(bag)]) * 1e-9
    assert np.abs(logged - time.time()).max() < 120.0
    assert 'for it never came' in recorder.text


def test_a_pacer_keeps_to_the_clock_it_is_given():
    """By hand: standing still holds it up, a jump is gone on from."""
    now, looks, done, jumps = [0.0], [], [], []
    steps = (Step(0.1 * (i + 1), lambda i=i: done.append(i)) for i in range(1000))

    def clock():
        looks.append(now[0])
        return now[0]

    pacer = Pacer(steps, lambda: True, 1.0, lambda _: None, clock, lambda: jumps.append(now[0]))

    def at(value, count):
        now[0], before, end = value, len(looks), time.monotonic() + 60.0
        # It looks again before each step, and while nothing is due.
        while len(looks) < before + 10 and time.monotonic() < end:
            time.sleep(0.01)
        assert len(done) == count

    pacer.start()
    at(0.0, 0)
    at(0.55, 5)
    at(0.55, 5)
    at(100.0, 5)
    at(100.22, 7)
    at(50.0, 7)
    at(50.25, 10)
    pacer.stop()
    assert jumps == [100.0, 50.0]


def test_what_the_first_step_waits_for_is_no_lateness():
    """A stream waits in its first step until its subscribers have the set-up."""
    now, over = [0.0], threading.Event()

    def steps():
        now[0] += 0.9
        for number in range(3):
            yield Step(0.0, partial(now.__setitem__, 0, now[0] + 0.7 * (number == 1)))

    pacer = Pacer(steps(), lambda: True, 1.0, lambda _: over.set(), lambda: now[0])
    pacer.start()
    assert over.wait(60.0)
    # The second step takes 0.7 s, for which the third is late.
    assert (pacer.late, pacer.latest) == (1, pytest.approx(0.7))


def test_a_stream_that_has_caught_up_or_ended_is_not_behind():
    now, over, behind = [0.0], threading.Event(), []
    moves = (0.9, 0.0, 1.0, 0.0)

    def act(i):
        now[0] += moves[i]
        behind.append(pacer.behind)
        now[0] = max(now[0], 0.5 * (i + 1))

    steps = (Step(0.5 * i, partial(act, i)) for i in range(4))
    pacer = Pacer(steps, lambda: True, 1.0, lambda _: over.set(), lambda: now[0])
    pacer.start()
    assert over.wait(60.0)
    assert behind == pytest.approx([0.0, 0.4, 0.0, 0.5]) and pacer.behind == 0.0


def test_a_stream_that_was_held_up_has_seen_no_jump(monkeypatch):
    """It catches up, as by the computer's own clock; what jumps meanwhile has jumped."""
    now, steady, over, done, jumps = [0.0], [0.0], threading.Event(), [], []
    monkeypatch.setattr(
        'actuator_glue.nodes.pacer.time', SimpleNamespace(monotonic=lambda: steady[0])
    )

    def held_up(seconds, jump):
        now[0] += seconds + jump
        steady[0] += seconds
        done.append(now[0])

    steps = iter(
        [
            Step(0.0, partial(held_up, 3.0, 0.0)),
            Step(2.0, partial(held_up, 3.0, 500.0)),
            Step(3.5, partial(held_up, 0.0, 0.0)),
        ]
    )
    pacer = Pacer(
        steps,
        lambda: True,
        1.0,
        lambda _: over.set(),
        lambda: now[0],
        lambda: jumps.append(now[0]),
    )
    pacer.start()
    probed = time.monotonic() + 60.0
    while len(done) < 2 and time.monotonic() < probed:
        time.sleep(0.01)
    # The second was late and done at once; the third waits for its time by the clock that jumped.
    assert done == [3.0, 506.0]
    while not jumps and time.monotonic() < probed:
        time.sleep(0.01)
    assert jumps == [506.0] and len(done) == 2
    now[0] += 0.5
    assert over.wait(60.0) and done == [3.0, 506.0, 506.5]


def test_of_a_fast_clock_being_held_up_is_no_jump_either(monkeypatch):
    """By hand: twenty seconds in one are what this clock has shown, two hundred are a jump."""
    now, steady, over, done, jumps = [0.0], [0.0], threading.Event(), [], []
    monkeypatch.setattr(
        'actuator_glue.nodes.pacer.time', SimpleNamespace(monotonic=lambda: steady[0])
    )

    def act(seconds, pace):
        steady[0] += seconds
        now[0] += pace * seconds
        done.append(now[0])

    usual = [Step(0.79 * i, partial(act, 0.04, 20.0)) for i in range(100)]
    last = [Step(79.0, partial(act, 0.5, 20.0)), Step(89.0, partial(act, 0.5, 200.0))]
    steps = iter([*usual, *last, Step(95.0, lambda: None)])
    pacer = Pacer(
        steps,
        lambda: True,
        1.0,
        lambda _: over.set(),
        lambda: now[0],
        lambda: jumps.append(now[0]),
    )
    pacer.start()
    end = time.monotonic() + 60.0
    while not jumps and time.monotonic() < end:
        time.sleep(0.01)
    pacer.stop()
    assert jumps == [pytest.approx(190.0)] and done[-2:] == pytest.approx([90.0, 190.0])


def test_after_a_jump_nothing_is_made_in_a_hurry():
    """What was late before is due now: its stamps, made anew, would run ahead of the clock."""
    now, over, done = [0.0], threading.Event(), []

    def act(moved):
        now[0] += moved
        done.append(now[0])

    # The second is late by 0.8 s when the clock jumps; the third comes 0.1 s after it.
    moves = ((0.0, 0.9), (0.1, 500.0), (0.2, 0.0), (0.3, 0.0))
    steps = (Step(due, partial(act, moved)) for due, moved in moves)
    pacer = Pacer(steps, lambda: True, 1.0, lambda _: over.set(), lambda: now[0])
    pacer.start()
    end = time.monotonic() + 60.0
    while len(done) < 3 and time.monotonic() < end:
        time.sleep(0.01)
    time.sleep(0.1)
    assert done == [0.9, 500.9, 500.9]
    now[0] += 0.11
    assert over.wait(60.0) and done[3] == 501.01
