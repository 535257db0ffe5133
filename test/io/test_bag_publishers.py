"""Two publishers on one topic of samples: said where a bag is read, and no good bag is refused."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from bag_content import samples, setup

import actuator_glue as ag
from actuator_glue.io import messages
from actuator_glue.io.bag_publishers import Publishers
from actuator_glue.io.bag_records import read_records
from actuator_glue.io.bag_writer import BagWriter
from actuator_glue.records import Record
from actuator_glue.sample_block import Block

SHARED = 'two publishers share it'
SIZE, PERIOD = 10, 1e-3


def stream(count: int, index: int = 0, start_ns: int = 10**18, jitter: float = 0.0) -> list[Block]:
    """Blocks of one publisher; stamps may jitter [s]."""
    rng = np.random.default_rng(index)
    zeros = np.zeros(SIZE)
    return [
        Block(
            index + SIZE * i,
            PERIOD,
            start_ns + round(1e9 * (SIZE * i * PERIOD + jitter * rng.standard_normal())),
            zeros,
            zeros,
        )
        for i in range(count)
    ]


def merged(first: list[Block], *others: list[Block], late: int = 0) -> list[Block]:
    """In turn, the others from block `late` of the first on."""
    out = first[:late]
    for blocks in zip(first[late:], *others, strict=False):
        out += blocks
    return out


def told(blocks: list[Block]) -> str:
    found = Publishers()
    for block in blocks:
        found.take(block)
    return found.told


@pytest.mark.parametrize('index', [0, SIZE, 50, 12_340, 10**9])
@pytest.mark.parametrize('apart', [0.0, 1e-5, 0.05, 3.0])
@pytest.mark.parametrize('jitter', [0.0, 1e-4])
def test_two_publishers_are_told(index: int, apart: float, jitter: float) -> None:
    """Whatever their numbers, their clocks and when the second one begins."""
    other = stream(40, index, 10**18 + round(1e9 * apart), jitter)
    for late in (0, 1, 30):
        assert told(merged(stream(80, jitter=jitter), other, late=late))


def test_blocks_of_two_rates_and_three_publishers_are_told() -> None:
    """One sends a hundred blocks for each of the other's."""
    mixed, slow = [], stream(10, 7)
    for i, block in enumerate(stream(900)):
        mixed += [block, slow[i // 100]] if i % 100 == 50 else [block]
    assert told(mixed)
    assert told(merged(stream(40), stream(40, 3), stream(40, 10**6)))


def good() -> Iterator[tuple[str, list[Block]]]:
    """Streams of one publisher that are not one even row of blocks."""
    once = stream(50)
    yield 'one', once
    yield 'no number at all', [replace(block, index=0) for block in once]
    yield 'again and again', [b for run in range(9) for b in stream(50, 0, 10**18 + run * 10**10)]
    yield 'again at the same time', [b for _ in range(9) for b in stream(50, jitter=1e-4)]
    longer = [b for run in range(1, 9) for b in stream(10 * run, jitter=1e-4)]
    yield 'again, each time longer, at the same time', longer
    yield 'lost', [block for i, block in enumerate(stream(500)) if i % 7]
    late = [replace(b, stamp_ns=b.stamp_ns + 10**9 * (i // 9)) for i, b in enumerate(once)]
    yield 'a clock that jumps', late
    yield 'a gap and again', [*once[:20], *once[30:], *stream(60, 0, 10**18 + 10**10)]


@pytest.mark.parametrize(('name', 'blocks'), [*good()])
def test_one_publisher_is_never_two(name: str, blocks: list[Block]) -> None:
    """Tests that begin again, lose samples or have their clock set."""
    assert told(blocks) == ''


Make = Callable[..., Record]


@pytest.fixture
def shared(tmp_path: Path, record: Record) -> Path:
    """A bag: the first half alone, then a second publisher's in turn with it, then alone again."""
    bag = tmp_path / 'bag'
    with BagWriter(bag) as writer:
        writer.add_topic('/samples', 'SampleBlock')
        writer.add_topic('/test_setup', 'TestSetup')
        writer.write('/test_setup', setup(record, 0, 250e3), 0)
        for at in range(0, len(record), SIZE):
            writer.write('/samples', samples(record, at, at + SIZE), record.stamp_ns(at))
            if 200 <= at < 300:
                other = samples(record, at - 200, at - 200 + SIZE)
                other.header = messages.header(record.stamp_ns(at) + 10**6, 'rig')
                writer.write('/samples', other, record.stamp_ns(at))
    return bag


def test_a_shared_topic_says_why_it_cannot_be_read(shared: Path, record: Record) -> None:
    """Where they begin to take turns and what to do; what is before and behind can be taken."""
    with pytest.raises(ag.InputError, match=rf'/samples: {SHARED}.* at 210 and at 10;.*--split'):
        read_records(shared)
    with pytest.raises(ag.InputError, match=SHARED):
        ag.load(shared)
    notes: list[str] = []
    before, behind = read_records(shared, gap=notes.append)
    assert before.command.tobytes() == record.command[:210].tobytes()
    assert behind.command.tobytes() == record.command[310:].tobytes()
    assert behind.first_index == 310
    (note,) = notes
    assert SHARED in note and 'left out' in note


def test_a_replay_says_why_nothing_can_be_estimated(shared: Path) -> None:
    """In place of a window that is too long for the data."""
    with pytest.raises(ag.InputError, match=f'not one window could be estimated: {SHARED}'):
        ag.replay(shared, window=0.45, hop=0.45, settle=0.1)
