"""Files that somebody damaged or made up: one clear error, soon, and little memory.

Each file is a good one of its format with bytes changed, cut, repeated or blown up.
"""

import os
import random
import resource
import time
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from actuator_glue.errors import InputError
from actuator_glue.io.load import load_records
from benchmarks.fuzz.files import COUNT, FORMATS, read_all

SECONDS = 5.0  # for one file of a few kilobytes, on a computer with other work
MEGABYTES = 300  # beyond what the process had
LONG_RUN = int(os.environ.get('ACTUATOR_GLUE_FUZZ', '2000'))  # files per format of the long run


@pytest.fixture(scope='module')
def good(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """Good files of every format, which are read."""
    folder = tmp_path_factory.mktemp('good')
    found = {}
    for name, (suffix, make, use) in FORMATS.items():
        path = folder / f'{name}{suffix}'
        make(path)
        if use is read_all:
            (record,) = load_records(path)
            assert len(record) in (50, COUNT)
        use(path)
        found[name] = path.read_bytes()
    return found


def damaged(content: bytes, seed: int) -> bytes:
    """Return bytes that are changed, cut, repeated, or numbers blown up, at a few places."""
    chance = random.Random(seed)
    data = bytearray(content)
    for _ in range(chance.choice((1, 1, 2, 4, 16))):
        # Heads and ends decide most: half of all changes are there.
        edge = chance.choice((64, 512, len(data)))
        at = chance.randrange(max(min(edge, len(data)), 1))
        at = max(len(data) - 1 - at, 0) if chance.random() < 0.4 else at
        kind = chance.randrange(7)
        if kind == 0:
            data[at : at + 1] = bytes([chance.randrange(256)])
        elif kind == 1:
            data[at : at + 4] = chance.choice((b'\xff' * 4, b'\x00' * 4, b'\x7f\xff\xff\xff'))
        elif kind == 2:
            data[at : at + 8] = chance.choice((b'\xff' * 8, b'\x00' * 7 + b'\x40', b'\x01' * 8))
        elif kind == 3:
            del data[at : at + chance.choice((1, 8, 200))]
        elif kind == 4:
            data = data[: at + 1]
        elif kind == 5:
            data[at:at] = data[at : at + chance.choice((1, 16, 300))]
        else:
            data[at:at] = chance.choice(
                (b'&a *a ', b'[' * 50, b'{' * 50, b'9' * 40, b'1e999', b'\n')
            )
    return bytes(data)


def check(name: str, content: bytes, path: Path) -> None:
    """Read a file; nothing but InputError comes out, soon, and memory stays."""
    use = FORMATS[name][2]
    path.write_bytes(content)
    begin = time.process_time()
    try:
        use(path)
    except InputError as error:
        assert str(error).isprintable()
    assert time.process_time() - begin < SECONDS


def test_damage_that_was_found_once(tmp_path: Path, good: dict[str, bytes]) -> None:
    """A first column that is no time, below headings of too few entries; an empty channel.

    A heading that ends after `Separator`. A row group that claims 395 136 991 204 rows: the
    computer ran out of memory.
    """
    for seed in (8996, 2002547):
        check('labview', damaged(good['labview'], seed), tmp_path / 'file.lvm')
    check('tdms', damaged(good['tdms'], 261268), tmp_path / 'file.tdms')
    check('parquet', damaged(good['parquet'], 1000095), tmp_path / 'file.parquet')


@pytest.mark.parametrize('name', FORMATS)
@settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(seed=st.integers(0, 2**32))
def test_damage_is_one_clear_error(
    tmp_path: Path, good: dict[str, bytes], name: str, seed: int
) -> None:
    """Sixty files of every format; hypothesis keeps those that failed."""
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    check(name, damaged(good[name], seed), tmp_path / f'file{FORMATS[name][0]}')
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < MEGABYTES * 1024


@pytest.mark.slow
@pytest.mark.timeout(7200)
@pytest.mark.parametrize('name', FORMATS)
def test_damage_in_the_long_run(
    tmp_path: Path, good: dict[str, bytes], name: str, rng_seed: int
) -> None:
    """Thousands of files of every format; ACTUATOR_GLUE_FUZZ says how many."""
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for seed in range(LONG_RUN):
        content = damaged(good[name], rng_seed + seed)
        try:
            check(name, content, tmp_path / f'file{FORMATS[name][0]}')
        except BaseException:
            (tmp_path / f'failed{FORMATS[name][0]}').write_bytes(content)
            print(f'{name}: seed {rng_seed + seed}')
            raise
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < MEGABYTES * 1024
