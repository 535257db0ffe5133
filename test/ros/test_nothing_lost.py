"""Killed nodes and full disks: what was recorded is kept, and what begins anew says so."""

import os
import resource
import shutil
import signal
import subprocess
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from actuator_glue_msgs.msg import SampleBlock
from rclpy.duration import Duration
from rclpy.qos import QoSProfile
from ros_nodes import QUICK, RATE, recorded

from actuator_glue.io.bag_reader import decoded, messages, summarise
from actuator_glue.io.recover import recover
from actuator_glue.nodes.recorder import SYNC_PERIOD

# What a kill may cost [s].
LOST = 0.5
# How long a recorder may take until it has recorded three seconds [s]: on a computer that is busy
# importing alone takes a minute.
START = 240.0


def until_it_records(probe, recorder, file):
    """Wait until a bag has three seconds; return when it was made, and how long that took."""
    began = time.monotonic()
    made = None
    while not (file.exists() and file.stat().st_size > 120_000):
        probe.for_a_while(0.1)
        made = time.monotonic() - began if made is None and file.exists() else made
        if not recorder.alive or time.monotonic() - began > START:
            raise AssertionError(f'bag made after {made} s; {probe.health}; {recorder.text}')
    return made or 0.0, time.monotonic() - began


def killed_at_random(start, probe, tmp_path, times, seed):
    """Kill a recorder again and again in the middle of a stream; each bag is mended and whole."""
    rng = np.random.default_rng(seed)
    heard, newest = {}, [0.0]

    def hear(message, info):
        newest[0] = 1e-9 * info['source_timestamp']
        heard[message.index] = newest[0], bytes(message.measured)

    probe.create_subscription(SampleBlock, 'samples', hear, QoSProfile(depth=2000))
    simulator = start('actuator_sim', rate=1000.0, repeat=True, rest=0.0, block=10)
    probe.until(lambda: heard, what='samples')
    worst, starts = 0.0, []
    for number in range(times):
        bag = tmp_path / f'bag_{number}'
        recorder = start('recorder', name=f'recorder_{number}', bag=str(bag))
        starts.append(until_it_records(probe, recorder, bag / f'bag_{number}_0.mcap'))
        probe.for_a_while(float(rng.uniform(0.0, 1.0)))
        starved = recorder.waited_for_a_core()
        probe.for_a_while(2.0 * LOST)
        # The test may itself be held up before the signal: what is sent then counts for nothing.
        killed = time.time()
        recorder.stop()
        # What it waited for a core is the computer's loss, not the recorder's.
        starved = recorder.waited_for_a_core() - starved
        recorder.process.send_signal(signal.SIGKILL)
        recorder.process.wait()
        cut = []
        before = [(m.topic, m.log_time, m.data) for m in messages(bag, note=cut.append)]
        mended = recover(bag)
        whole = [(m.topic, m.log_time, m.data) for m in messages(bag)]
        assert whole == before and mended.messages == len(whole)
        assert (bag / 'metadata.yaml').exists() and summarise(bag).finished
        blocks = [m for _, m in decoded(bag, ('SampleBlock',))]
        index = [m.index for m in blocks]
        sizes = [len(m.command) for m in blocks]
        assert np.array_equal(np.diff(index), sizes[:-1])
        # What the test itself has yet to take from DDS.
        probe.until(lambda killed=killed: newest[0] > killed, what='what was sent until the kill')
        assert all(bytes(m.measured) == heard[m.index][1] for m in blocks)
        late = max(i for i, (sent, _) in heard.items() if sent <= killed)
        missing = (late - index[-1]) / 1000.0
        worst = max(worst, missing)
        made, took = starts[-1]
        print(
            f'kill {number + 1}: {missing:.3f} s missing, {starved:.3f} s without a core; '
            f'bag made after {made:.1f} s, three seconds recorded after {took:.1f} s',
            flush=True,
        )
        assert missing <= LOST + starved
        for old in [i for i in heard if i < late - 2000]:
            del heard[old]
    assert simulator.alive and simulator.end() == 0
    made, took = np.max(starts, axis=0)
    print(
        f'{times} kills: {worst:.3f} s missing at most; slowest start: bag made after '
        f'{made:.1f} s, three seconds recorded after {took:.1f} s'
    )


def test_a_recorder_that_is_killed_loses_half_a_second_at_most(start, probe, tmp_path, rng_seed):
    killed_at_random(start, probe, tmp_path, 2, rng_seed)


@pytest.mark.slow
@pytest.mark.timeout(7200)
def test_a_hundred_kills_lose_half_a_second_each_at_most(start, probe, tmp_path, rng_seed):
    killed_at_random(start, probe, tmp_path, 100, rng_seed)


def sending(probe, condition):
    """The condition, looked at after each of a stream of blocks of 2 kB."""

    def looked_at():
        probe.block(np.zeros(100), np.zeros(100))
        return condition()

    return looked_at


@pytest.mark.slow
def test_what_comes_while_a_disk_is_full_is_recorded_when_it_is_not(start, probe, tmp_path):
    """The largest file allowed shrinks while the recorder runs, as a quota does, and grows."""
    bag = tmp_path / 'bag'
    recorder = start('recorder', bag=str(bag))
    probe.open_stream()

    def number(key):
        return probe.number('recorder', key)

    probe.until(sending(probe, lambda: number('messages written') > 50), what='recording')
    _, most = resource.prlimit(recorder.process.pid, resource.RLIMIT_FSIZE, (20_000, -1))
    full = sending(probe, lambda: 'quota is full' in probe.faults['recorder'])
    probe.until(full, what='a full disk')
    written = number('messages written')
    probe.until(sending(probe, lambda: number('messages waiting (B)') > 50_000), what='it waits')
    assert number('messages written') <= written
    resource.prlimit(recorder.process.pid, resource.RLIMIT_FSIZE, (most, most))
    again = sending(probe, lambda: 'takes messages again' in recorder.text)
    probe.until(again, what='it goes on')
    probe.until(sending(probe, lambda: number('messages written') > probe.index / 100 - 50))
    assert probe.value('recorder', 'messages lost') == '0'
    assert probe.samples_out.wait_for_all_acked(Duration(seconds=60.0))
    assert recorder.end() == 0 and 'Traceback' not in recorder.text
    assert (bag / 'metadata.yaml').exists() and summarise(bag).finished
    assert np.array_equal(recorded(bag), np.arange(probe.index))
    assert recover(bag).notes == []


@pytest.fixture
def small_disk(tmp_path):
    """A disk of 3 MB, where this user may mount one."""
    folder = tmp_path / 'small'
    folder.mkdir()
    command = ['mount', '-t', 'tmpfs', '-o', 'size=3m', 'tmpfs', str(folder)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        pytest.skip(f'no disk of its own here ({done.stderr.strip()})')
    yield folder
    subprocess.run(['umount', '--lazy', str(folder)], check=True)


def test_a_disk_that_stays_full_leaves_a_finished_bag_and_the_loss_is_told(
    small_disk, start, probe
):
    bag = small_disk / 'bag'
    recorder = start('recorder', bag=str(bag))
    probe.open_stream()

    def number(key):
        return probe.number('recorder', key)

    probe.until(sending(probe, lambda: number('messages written') > 50), what='recording')
    with (small_disk / 'other').open('wb', buffering=0) as file, suppress(OSError):
        while file.write(bytes(4096)):
            pass
    full = sending(probe, lambda: 'quota is full' in probe.faults['recorder'])
    probe.until(full, what='a full disk')
    probe.until(sending(probe, lambda: number('messages waiting (B)') > 50_000), what='it waits')
    assert probe.samples_out.wait_for_all_acked(Duration(seconds=60.0))
    # What could not be written is lost with the process: it says how much, and fails.
    assert recorder.end() == 1, recorder.text
    probe.until(lambda: 'more are lost' in probe.faults['recorder'], what='the loss')
    lost = number('messages lost')
    assert lost > 20 and f'{lost:g} more are lost' in recorder.text
    assert 'Traceback' not in recorder.text
    assert (bag / 'metadata.yaml').exists() and summarise(bag).finished
    index = recorded(bag)
    assert len(index) > 5000 and np.array_equal(index, np.arange(len(index)))
    assert probe.index - len(index) <= 100 * lost
    assert recover(bag).notes == []


def test_a_bag_that_is_deleted_while_it_is_recorded_is_brought_back_and_told(
    start, probe, tmp_path
):
    bag = tmp_path / 'bag'
    recorder = start('recorder', bag=str(bag))
    probe.open_stream()

    def written(count):
        return lambda: probe.number('recorder', 'messages written') > count

    probe.until(sending(probe, written(50)), what='recording')
    shutil.rmtree(bag)
    told = sending(probe, lambda: 'was deleted' in probe.faults['recorder'])
    probe.until(told, what='that it was deleted')
    assert probe.samples_out.wait_for_all_acked(Duration(seconds=60.0))
    assert recorder.end() == 0, recorder.text
    assert np.array_equal(recorded(bag), np.arange(probe.index))
    assert summarise(bag).finished and 'finished' in recorder.text


def test_a_bag_that_is_moved_while_it_is_recorded_is_told_and_whole_once_it_is_back(
    start, probe, tmp_path
):
    bag, away = tmp_path / 'bag', tmp_path / 'away'
    recorder = start('recorder', bag=str(bag))
    probe.open_stream()
    recording = sending(probe, lambda: probe.number('recorder', 'messages written') > 50)
    probe.until(recording, what='recording')
    assert not probe.faults['recorder']
    bag.rename(away)
    told = sending(probe, lambda: 'was moved' in probe.faults['recorder'])
    probe.until(told, what='that it was moved')
    away.rename(bag)
    assert probe.samples_out.wait_for_all_acked(Duration(seconds=60.0))
    assert recorder.end() == 0, recorder.text
    assert np.array_equal(recorded(bag), np.arange(probe.index))
    assert summarise(bag).finished


@pytest.fixture
def breakable(tmp_path):
    """A disk that goes read-only at its first error: folder, what breaks it, what remounts it."""
    image, folder = tmp_path / 'disk.img', tmp_path / 'disk'
    folder.mkdir()

    def run(*command):
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode:
            raise OSError(f'{command[0]}: {done.stderr.strip()}')
        return done.stdout

    def mount():
        run('mount', '-o', 'loop,errors=remount-ro', str(image), str(folder))

    try:
        with image.open('wb') as file:
            file.truncate(64 << 20)
        run('mkfs.ext4', '-q', '-F', str(image))
        mount()
        device = Path(run('findmnt', '-n', '-o', 'SOURCE', str(folder)).strip()).name
        trigger = Path('/sys/fs/ext4', device, 'trigger_fs_error')
        if not os.access(trigger, os.W_OK):
            raise OSError(f'{trigger} cannot be written')
    except OSError as error:
        pytest.skip(f'no disk of its own here ({error})')

    def remount():
        run('umount', str(folder))
        mount()

    yield folder, lambda: trigger.write_text('test'), remount
    run('umount', str(folder))


@pytest.mark.slow  # needs root and a loop device
def test_a_disk_that_goes_read_only_keeps_all_but_the_last_seconds(breakable, start, probe):
    """As after a fault of the disk or of the power: only what the disk itself has comes back."""
    folder, break_it, remount = breakable
    bag = folder / 'bag'
    newest = []
    probe.create_subscription(SampleBlock, 'samples', lambda m: newest.append(m.index), 100)
    recorder = start('recorder', bag=str(bag))
    simulator = start('actuator_sim', rate=1000.0, repeat=True, wait_for=1)
    probe.until(lambda: probe.number('recorder', 'messages written') > 500, what='recording')
    before = newest[-1]
    break_it()
    probe.until(lambda: 'read-only' in probe.faults['recorder'], what='a read-only disk')
    probe.for_a_while(2.0)
    assert recorder.alive
    # What came since is lost with the process: it says so, and fails.
    assert recorder.end() == 1 and 'more are lost' in recorder.text
    assert 'Traceback' not in recorder.text
    assert simulator.end() == 0
    remount()
    assert recover(bag).messages > 0
    index = recorded(bag)
    assert np.array_equal(index, np.arange(index[0], index[0] + len(index)))
    missing = (before - index[-1]) / 1000.0
    print(f'{missing:.2f} s missing')
    assert missing <= SYNC_PERIOD + 1.0


def test_a_folder_that_cannot_be_written_is_said(start):
    recorder = start('recorder', bag='/proc/none/bag')
    assert recorder.wait(60) == 2 and 'cannot' in recorder.text


@pytest.mark.slow
def test_an_estimator_that_is_killed_begins_anew_and_says_so(start, probe):
    simulator = start('actuator_sim', rate=RATE, repeat=True, duration=20.0, wait_for=1)
    first = start('estimator', **QUICK)
    probe.until(lambda: probe.number('estimator', 'windows') >= 1, 250, 'windows')
    assert 'begins anew' not in first.text
    first.kill()
    probe.health.clear()
    second = start('estimator', **QUICK)
    probe.until(lambda: 'begins anew at sample' in probe.faults['estimator'], 250, 'begins anew')
    probe.until(lambda: probe.number('estimator', 'windows') >= 1, what='windows')
    assert second.end() == 0 and simulator.end() == 0
