"""Records and bags that the tests of io share."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from actuator_glue.io.bag_records import write_record
from actuator_glue.io.bag_writer import BagWriter
from actuator_glue.records import Record


def _make_record(
    samples: int = 500, stiffness: float | None = 250e3, *, force: bool = True, first: int = 0
) -> Record:
    """Return a record whose every sample is different."""
    rng = np.random.default_rng(samples + first)
    command, measured = rng.standard_normal((2, samples)) * 1e-3
    return Record(
        command,
        measured,
        period=1e-3,
        stiffness=stiffness,
        force=rng.standard_normal(samples) * 1e3 if force else None,
        start_ns=1_000_000_000 + first * 1_000_000,
        first_index=first,
        actuator='mts',
        source='made for a test',
    )


@pytest.fixture(scope='session')
def make_record() -> Callable[..., Record]:
    """Return a function that makes records."""
    return _make_record


@pytest.fixture
def record() -> Record:
    """Half a second at 1 kHz with a force channel."""
    return _make_record()


@pytest.fixture
def bag(tmp_path: Path, record: Record) -> Path:
    """A finished bag of `record` in blocks of 16 samples."""
    path = tmp_path / 'bag'
    with BagWriter(path) as writer:
        write_record(writer, record, block=16)
    return path
