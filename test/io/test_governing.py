"""One rule says which set-up governs a sample, whether a bag is calibrated or replayed."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from bag_content import samples, setup

from actuator_glue.io.bag_reader import decoded
from actuator_glue.io.bag_records import read_records
from actuator_glue.io.bag_writer import BagWriter
from actuator_glue.online.playback import items
from actuator_glue.online.settings import EstimatorSettings
from actuator_glue.online.windows import SlidingWindows, Window
from actuator_glue.records import Record
from actuator_glue.setups import StreamSetup


def windows(bag: Path) -> list[Window]:
    """Return the windows of a replay."""
    settings = EstimatorSettings(window=0.05, hop=0.01, settle=0.0, time_budget=0.01)
    sliding = SlidingWindows(settings)
    found: list[Window] = []
    for item in items(decoded(bag, ['SampleBlock', 'TestSetup'])):
        if isinstance(item, StreamSetup):
            sliding.setup(item)
        else:
            found += sliding.push(item)[1]
    return found


def unset(message: object, *, stamp: bool = False, index: bool = False) -> object:
    """Return a set-up whose publisher left something at zero."""
    if stamp:
        message.header.stamp.sec = message.header.stamp.nanosec = 0
    if index:
        message.index = 0
    return message


def bag(path: Path, record: Record, case: str) -> list[float]:
    """Write two tests with 0 and 5e4 N/m; return how many samples each of the three parts has."""
    again = replace(record, start_ns=record.start_ns + 10**10)
    with BagWriter(path) as writer:
        writer.add_topic('/samples', 'SampleBlock')
        writer.add_topic('/test_setup', 'TestSetup')
        writer.write('/test_setup', setup(record, 0, 0.0), 0)
        if case == 'ahead':  # announced early, begins within a block
            writer.write('/test_setup', setup(record, 225, 5e4), 0)
        for start in range(0, 500, 50):
            if start == 200 and case != 'ahead':
                late = setup(record, 200, 5e4)
                late = unset(late, stamp=case == 'no stamp', index=case == 'no index')
                writer.write('/test_setup', late, start)
            writer.write('/samples', samples(record, start, start + 50), start + 1)
        writer.write('/test_setup', setup(again, 0, 7e4), 1000)
        for start in range(0, 500, 50):
            writer.write('/samples', samples(again, start, start + 50), 1001 + start)
    first = 225 if case == 'ahead' else 200
    return [first, 500 - first, 500]


@pytest.mark.parametrize('case', ['usual', 'ahead', 'no stamp', 'no index'])
def test_calibrate_and_replay_agree(tmp_path: Path, record: Record, case: str) -> None:
    """Also where a set-up begins within a block, and where stamp or index were left at zero."""
    lengths = bag(tmp_path / 'bag', record, case)
    records = read_records(tmp_path / 'bag')
    assert [len(r) for r in records] == lengths
    assert [r.stiffness for r in records] == [0.0, 5e4, 7e4]
    seen = [0, 0, 0]
    for window in windows(tmp_path / 'bag'):
        at = window.record.start_ns
        (k,) = (i for i, r in enumerate(records) if r.start_ns <= at < r.stamp_ns(len(r)))
        held, first = records[k], window.record.first_index - records[k].first_index
        seen[k] += 1
        assert (window.record.stiffness, window.record.hold) == (held.stiffness, held.hold)
        part = held.command[first : first + len(window.record)]
        np.testing.assert_array_equal(window.record.command, part)
    assert min(seen) > 10


def test_what_comes_late_reaches_back_where_its_stamp_says_so(
    tmp_path: Path, record: Record
) -> None:
    """A bag knows what a live node cannot: a set-up recorded after samples it holds for."""
    with BagWriter(tmp_path / 'bag') as writer:
        writer.add_topic('/samples', 'SampleBlock')
        writer.add_topic('/test_setup', 'TestSetup')
        writer.write('/test_setup', setup(record, 0, 0.0), 0)
        for start in range(0, 500, 50):
            writer.write('/samples', samples(record, start, start + 50), start)
        writer.write('/test_setup', setup(record, 225, 5e4), 500)
    records = read_records(tmp_path / 'bag')
    assert [(len(r), r.stiffness) for r in records] == [(225, 0.0), (275, 5e4)]


def test_a_stream_that_begins_again_with_set_ups_announced_ahead(
    tmp_path: Path, record: Record
) -> None:
    """Calibration and replay take each from the sample it names, in the second test as well."""
    lengths, stiffnesses = [225, 275] * 2, [0.0, 5e4, 7e4, 9e4]
    with BagWriter(tmp_path / 'bag') as writer:
        writer.add_topic('/samples', 'SampleBlock')
        writer.add_topic('/test_setup', 'TestSetup')
        for test in range(2):
            one, at = replace(record, start_ns=record.start_ns + test * 10**10), 1000 * test
            for index, stiffness in zip((0, 225), stiffnesses[2 * test :], strict=False):
                writer.write('/test_setup', setup(one, index, stiffness), at)
            for start in range(0, 500, 50):
                writer.write('/samples', samples(one, start, start + 50), at + 1 + start)
    records = read_records(tmp_path / 'bag')
    assert [len(r) for r in records] == lengths
    assert [r.stiffness for r in records] == stiffnesses
    found = windows(tmp_path / 'bag')
    told = [w.record.stiffness for w in found]
    assert list(dict.fromkeys(told)) == stiffnesses and told == sorted(told)
    for window in found:
        first, after = window.record.first_index, window.record.stiffness in (5e4, 9e4)
        assert first + len(window.record) <= 225 or (after and first >= 225)
