"""Gaps, restarts and set-ups inside a bag, and what a killed writer leaves."""

import os
import signal
import subprocess
import sys
import textwrap
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bag_content import samples, setup
from mcap.writer import Writer

from actuator_glue.errors import InputError
from actuator_glue.io import messages
from actuator_glue.io.bag_records import check_order, read_records, write_record
from actuator_glue.io.bag_writer import BagWriter
from actuator_glue.io.mcap_scan import Scan
from actuator_glue.io.recover import recover
from actuator_glue.records import Record

Make = Callable[..., Record]


def open_bag(path: Path) -> BagWriter:
    """Return a writer with the two topics declared."""
    writer = BagWriter(path)
    writer.add_topic('/samples', 'SampleBlock')
    writer.add_topic('/test_setup', 'TestSetup')
    return writer


def test_missing_samples_are_told_or_split(tmp_path: Path, record: Record) -> None:
    """A gap is an error where nobody listens, and two records where somebody does."""
    with open_bag(tmp_path / 'bag') as writer:
        for start in (0, 100, 300, 400):
            writer.write('/samples', samples(record, start, start + 100), start)
    with pytest.raises(InputError, match=r'100 samples \(0\.1 s\) are missing before sample 300'):
        read_records(tmp_path / 'bag')
    told: list[str] = []
    first, second = read_records(tmp_path / 'bag', gap=told.append)
    assert len(told) == 1
    assert (len(first), len(second)) == (200, 200)
    assert (second.first_index, second.start_ns) == (300, record.stamp_ns(300))
    assert second.command.tobytes() == record.command[300:].tobytes()


def test_a_clock_that_jumps_back_is_told_or_splits(tmp_path: Path, record: Record) -> None:
    """Stamps that step by more than 0.1 s, though no sample is missing; jitter is nothing."""
    for name, steps in (('jump', (0, 0, -5e9)), ('jitter', (0, 0.09e9, 0.01e9))):
        with open_bag(tmp_path / name) as writer:
            for start, step in zip((0, 100, 200), steps, strict=True):
                block = samples(record, start, start + 100)
                block.header = messages.header(record.stamp_ns(start) + int(step) + 10**10, 'mts')
                writer.write('/samples', block, start)
    with pytest.raises(InputError, match=r'the clock jumps by -5 s at sample 200.*--split'):
        read_records(tmp_path / 'jump')
    told: list[str] = []
    assert [len(r) for r in read_records(tmp_path / 'jump', gap=told.append)] == [200, 100]
    assert len(told) == 1
    assert len(read_records(tmp_path / 'jitter')[0]) == 300


def test_a_stream_that_begins_again_is_a_new_record(tmp_path: Path, record: Record) -> None:
    """Two tests in one bag are two records, each with its own set-up."""
    with open_bag(tmp_path / 'bag') as writer:
        write_record(writer, record)
        later = replace(record, stiffness=0.0, start_ns=record.start_ns + 10**10)
        write_record(writer, later)
    first, second = read_records(tmp_path / 'bag')
    assert (first.stiffness, second.stiffness) == (250e3, 0.0)
    assert len(first) == len(second) == 500


@pytest.mark.parametrize('delay', [0, 1, 2])
def test_a_changed_setup_splits_at_its_sample(tmp_path: Path, record: Record, delay: int) -> None:
    """The set-up's stamp says from when on it holds, even if it is recorded some blocks late."""
    with open_bag(tmp_path / 'bag') as writer:
        writer.write('/test_setup', setup(record, 0, 0.0), 0)
        for i, start in enumerate(range(0, 500, 50)):
            if i == 4 + delay:
                writer.write('/test_setup', setup(record, 200, 5e4), start)
            writer.write('/samples', samples(record, start, start + 50), start)
    first, second = read_records(tmp_path / 'bag')
    assert (len(first), first.stiffness) == (200, 0.0)
    assert (len(second), second.stiffness) == (300, 5e4)


def test_a_setup_recorded_after_the_first_samples_still_holds(
    tmp_path: Path, record: Record
) -> None:
    """Latched topics may arrive late at the recorder."""
    with open_bag(tmp_path / 'bag') as writer:
        writer.write('/samples', samples(record, 0, 250), 0)
        writer.write('/samples', samples(record, 250, 500), 1)
        writer.write('/test_setup', setup(record, 0, 7e4), 2)
    (only,) = read_records(tmp_path / 'bag')
    assert only.stiffness == 7e4


def test_two_actuators_are_two_records(tmp_path: Path, record: Record, make_record: Make) -> None:
    """Namespaces keep actuators and their set-ups apart."""
    other = replace(make_record(stiffness=0.0), actuator='other')
    with BagWriter(tmp_path / 'bag') as writer:
        write_record(writer, record, namespace='/a')
        write_record(writer, other, namespace='/b')
    first, second = read_records(tmp_path / 'bag')
    assert (first.actuator, first.stiffness) == ('mts', 250e3)
    assert (second.actuator, second.stiffness) == ('other', 0.0)
    assert first.source.endswith(':/a/samples (record 1 of 2)')


def test_bad_samples_in_a_bag_are_one_message(tmp_path: Path, record: Record) -> None:
    """NaN, absurd values, unequal channels and bytes that are no message."""
    command = record.command[:100].copy()
    command[42] = np.nan
    cases = {'NaN': command, '1e+06 m': np.full(100, 1e6), 'different lengths': command[:50]}
    for i, (words, values) in enumerate(cases.items()):
        block = samples(record, 0, 100)
        block.command = values
        with open_bag(tmp_path / f'bag{i}') as writer:
            writer.write('/samples', block, 0)
        with pytest.raises(InputError, match=words.replace('+', r'\+')):
            read_records(tmp_path / f'bag{i}')
    for i, period in enumerate((0.0, np.nan, np.inf, -1.0, 1e9)):
        block = samples(record, 0, 100)
        block.period = period
        with open_bag(tmp_path / f'period{i}') as writer:
            writer.write('/samples', block, 0)
        with pytest.raises(InputError, match='period'):
            read_records(tmp_path / f'period{i}')
    with open_bag(tmp_path / 'bag') as writer:
        writer.write_raw('/samples', b'\x00\x01\x00\x00' + b'\xff' * 20, 0)
    with pytest.raises(InputError, match='are not a actuator_glue_msgs/msg/SampleBlock'):
        read_records(tmp_path / 'bag')


@pytest.mark.parametrize(('sent', 'known'), [(-1.0, None), (np.nan, None), (0.0, 0.0), (7.0, 7.0)])
def test_a_stiffness_that_nobody_filled_is_not_known(
    tmp_path: Path, record: Record, sent: float, known: float | None
) -> None:
    """-1 is what a message begins with; 0 is said by somebody: no specimen."""
    with open_bag(tmp_path / 'bag') as writer:
        writer.write('/test_setup', setup(record, 0, sent), 0)
        writer.write('/samples', samples(record, 0, 100), 1)
    (found,) = read_records(tmp_path / 'bag')
    assert found.stiffness == known


@pytest.mark.parametrize(
    ('name', 'value'),
    [
        ('specimen_stiffness', -2.0),
        ('specimen_stiffness', np.inf),
        ('specimen_stiffness', 1e15),
        ('hold', 'cubic'),
        ('rate', np.nan),
        ('rate', 0.0),
    ],
)
def test_a_set_up_that_cannot_be_is_left_out_and_told(
    tmp_path: Path, record: Record, name: str, value: object
) -> None:
    """As live nodes do: one warning, the other set-up and all samples are used."""
    wrong = setup(record, 0, 0.0)
    setattr(wrong, name, value)
    with open_bag(tmp_path / 'bag') as writer:
        writer.write('/test_setup', setup(record, 0, 7.0), 0)
        writer.write('/test_setup', wrong, 1)
        writer.write('/samples', samples(record, 0, 100), 2)
    told: list[str] = []
    (found,) = read_records(tmp_path / 'bag', warn=told.append)
    assert (len(found), found.stiffness, found.hold) == (100, 7.0, 'zoh')
    (line,) = told
    assert name.rpartition('_')[2] in line
    assert 'topic /test_setup' in line
    with pytest.warns(UserWarning, match='this set-up is not used'):
        read_records(tmp_path / 'bag')


RECORDER = textwrap.dedent(
    """
    import sys, time
    import numpy as np
    from actuator_glue.io import messages
    from actuator_glue.io.bag_writer import BagWriter

    writer = BagWriter(sys.argv[1])
    writer.add_topic('/samples', 'SampleBlock')
    zeros = np.zeros(10)
    index, start = 0, time.monotonic()
    while True:
        now = time.time_ns()
        block = messages.message(
            'SampleBlock', header=messages.header(now, 'a'), period=1e-3,
            index=index, command=zeros, measured=zeros, force=zeros[:0],
        )
        writer.write('/samples', block, now)
        print(now, flush=True)
        index += 10
        time.sleep(max(0.0, start + index * 1e-3 - time.monotonic()))
    """
)


def test_a_killed_recorder_loses_half_a_second_at_most(tmp_path: Path) -> None:
    """SIGKILL while recording: the rest is readable and recover finishes the bag."""
    with subprocess.Popen(
        [sys.executable, '-c', RECORDER, str(tmp_path / 'bag')], stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        process.stdout.readline()
        time.sleep(1.5)
        os.kill(process.pid, signal.SIGKILL)
        stamps = [int(line) for line in process.stdout.read().split()]
    assert not (tmp_path / 'bag' / 'metadata.yaml').exists()
    recovery = recover(tmp_path / 'bag')
    (record,) = read_records(tmp_path / 'bag')
    assert recovery.messages == len(record) // 10
    last = record.stamp_ns(len(record) - 10)
    # The recorder's loop ran on real time, so stamps tell how much of it was lost.
    lost = stamps[-1] - stamps[min(recovery.messages, len(stamps)) - 1]
    assert lost <= 0.5e9, (lost, last)


def slower(record: Record, start: int, stop: int, true: float) -> object:
    """Return samples of a record whose stamps tell another rate than its period."""
    block = samples(record, start, stop)
    stamp = record.start_ns + round(start / true * 1e9)
    block.header = messages.header(stamp, record.actuator)
    return block


@pytest.mark.parametrize('true', [500.0, 980.0, 1020.0, 2000.0])
def test_stamps_of_blocks_that_tell_another_rate_are_refused(
    tmp_path: Path, make_record: Make, true: float
) -> None:
    """A rate that was declared wrong: every time constant would be wrong by as much."""
    record = make_record(5000)
    with open_bag(tmp_path / 'bag') as writer:
        for start in range(0, 5000, 20):
            writer.write('/samples', slower(record, start, start + 20, true), start)
    with pytest.raises(InputError, match=rf'said to be 1000 Hz, but by the stamps .* {true:g} Hz'):
        read_records(tmp_path / 'bag')


@pytest.mark.parametrize('true', [995.0, 1000.0, 1008.0])
def test_stamps_that_jitter_and_drift_a_little_are_no_other_rate(
    tmp_path: Path, make_record: Make, true: float
) -> None:
    """Less than one in a hundred, and 3 ms of jitter."""
    record, late = make_record(5000), np.random.default_rng(3)
    with open_bag(tmp_path / 'bag') as writer:
        for start in range(0, 5000, 20):
            block = slower(record, start, start + 20, true)
            stamp = record.start_ns + round(start / true * 1e9 + late.exponential(3e6))
            block.header = messages.header(stamp, record.actuator)
            writer.write('/samples', block, start)
    (found,) = read_records(tmp_path / 'bag')
    assert np.array_equal(found.command, record.command)


@pytest.mark.parametrize('mixed', ['turned', 'halves', 'by topic', 'neighbours'])
def test_messages_out_of_the_order_of_their_times_are_put_in_order(
    tmp_path: Path, make_record: Make, mixed: str
) -> None:
    """As other tools write MCAP: samples, and each set-up from the sample it names."""
    record = make_record(4000)
    with open_bag(tmp_path / 'bag') as writer:
        writer.write('/test_setup', setup(record, 0, 1e5), record.start_ns)
        for start in range(0, 4000, 100):
            writer.write('/samples', samples(record, start, start + 100), record.stamp_ns(start))
        writer.write('/test_setup', setup(record, 2000, 2e5), record.stamp_ns(2000) - 1)
    (source,) = (tmp_path / 'bag').glob('*.mcap')
    rows = list(Scan(source, pytest.fail).messages())
    order = {
        'turned': rows[::-1],
        'halves': rows[20:] + rows[:20],
        'by topic': sorted(rows, key=lambda row: row[1].topic),
        'neighbours': [row for pair in zip(rows[1::2], rows[::2], strict=True) for row in pair],
    }[mixed]
    path = tmp_path / 'mixed.mcap'
    with path.open('wb') as file:
        writer = Writer(file)
        writer.start(profile='ros2', library='somebody')
        channels: dict[str, int] = {}
        for schema, channel, message in order:
            if channel.topic not in channels:
                kind = writer.register_schema(schema.name, schema.encoding, schema.data)
                channels[channel.topic] = writer.register_channel(channel.topic, 'cdr', kind)
            times = message.log_time, message.publish_time
            writer.add_message(channels[channel.topic], times[0], message.data, times[1])
        writer.finish()
    if mixed == 'by topic':  # the samples are in order
        check_order(path)
    else:
        with pytest.raises(InputError, match='not in the order of their times; put the samples'):
            check_order(path)
    first, second = read_records(path)
    assert np.array_equal(first.command, record.command[:2000])
    assert np.array_equal(second.command, record.command[2000:])
    assert (first.stiffness, second.stiffness) == (1e5, 2e5)


def test_a_period_that_differs_in_its_last_digits_is_one_test(
    tmp_path: Path, record: Record
) -> None:
    """A driver that measures its clock writes another period into each block."""
    rng = np.random.default_rng(1)
    with open_bag(tmp_path / 'bag') as writer:
        for start in range(0, 500, 50):
            block: Any = samples(record, start, start + 50)
            block.period *= 1.0 + 1e-9 * rng.uniform(-1.0, 1.0)
            writer.write('/samples', block, record.stamp_ns(start + 50))
    (found,) = read_records(tmp_path / 'bag')
    assert len(found) == 500 and found.command.tobytes() == record.command.tobytes()
    assert found.period == pytest.approx(record.period, rel=1e-8)
