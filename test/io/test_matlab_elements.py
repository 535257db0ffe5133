"""What would end the process in the library that reads MATLAB files is refused before."""

import struct
import zlib
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from actuator_glue.errors import InputError
from actuator_glue.io.load import load_records

HEADER = b'MATLAB 5.0 MAT-file'.ljust(124) + b'\x00\x01IM'
NUMBERS, CELL = 6, 1  # classes of arrays


def element(kind: int, data: bytes) -> bytes:
    """Type, length, data and padding of one element."""
    return struct.pack('<II', kind, len(data)) + data + bytes(-len(data) % 8)


def array(flags: int, *parts: bytes, shape: tuple[int, int] = (1, 1)) -> bytes:
    """One variable without a name."""
    head = element(6, struct.pack('<II', flags, 0)), element(5, struct.pack('<ii', *shape))
    return element(14, b''.join((*head, element(1, b''), *parts)))


def compressed(data: bytes) -> bytes:
    """The same in a file of version 7."""
    packed = zlib.compress(data)
    return struct.pack('<II', 15, len(packed)) + packed


def nested(depth: int) -> bytes:
    """A number in so many cells."""
    found = array(NUMBERS, element(9, bytes(8)))
    for _ in range(depth):
        found = array(CELL, found)
    return found


ODD = {
    'type 700': element(700, bytes(8)),
    'type 8': array(NUMBERS, element(8, bytes(8))),
    'damaged': array(NUMBERS | 0x800, element(9, bytes(8))),  # complex with no second part
    'its head says': array(NUMBERS, array(NUMBERS, element(9, bytes(8)))),
    'hold what': array(CELL, nested(0), shape=(2, 1)),
    'goes on|ends after|whole': array(NUMBERS, element(9, bytes(8)))[:-8],
    'deep': nested(5000),
}


@pytest.mark.parametrize('pack', [bytes, compressed])
@pytest.mark.parametrize('says', ODD)
def test_what_no_array_holds_is_refused(tmp_path: Path, says: str, pack: type) -> None:
    """A type without a reader, or a variable where numbers belong, ended the process."""
    path = tmp_path / 'a.mat'
    path.write_bytes(HEADER + pack(ODD[says]))
    with pytest.raises(InputError, match=says):
        load_records(path)


@pytest.mark.slow
def test_too_many_variables_are_refused_soon(tmp_path: Path) -> None:
    """Kilobytes that inflate to a million and more empty cells."""
    cell = struct.pack('<II', 14, 0)
    many = array(CELL, cell * 1_100_000, shape=(1_100_000, 1))
    (tmp_path / 'a.mat').write_bytes(HEADER + compressed(many))
    assert (tmp_path / 'a.mat').stat().st_size < 1e5
    with pytest.raises(InputError, match='more than 1000000 variables'):
        load_records(tmp_path / 'a.mat')


def test_a_variable_without_its_checksum_is_refused(tmp_path: Path) -> None:
    """A compressed variable that was cut off, its length with it."""
    packed = compressed(array(NUMBERS, element(9, np.arange(40.0).tobytes()), shape=(40, 1)))[8:-4]
    (tmp_path / 'a.mat').write_bytes(HEADER + struct.pack('<II', 15, len(packed)) + packed)
    with pytest.raises(InputError, match='not whole'):
        load_records(tmp_path / 'a.mat')


@pytest.mark.parametrize('version', ['4', '5'])
def test_good_files_of_every_version_are_read(tmp_path: Path, version: str) -> None:
    """Both byte for byte."""
    columns = {name: np.arange(40.0)[:, None] for name in ('command_mm', 'measured_mm')}
    savemat(tmp_path / 'a.mat', {'time_s': 1e-3 * np.arange(40.0), **columns}, format=version)
    (record,) = load_records(tmp_path / 'a.mat', stiffness=0.0)
    np.testing.assert_allclose(record.measured, 1e-3 * np.arange(40.0), atol=1e-15)
