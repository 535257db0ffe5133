"""Memory of long records goes back to the system."""

import platform
import subprocess
import sys

import numpy as np
import pytest

from actuator_glue.cli import _heap
from actuator_glue.records import Record

CODE = """
import sys
import numpy as np
from actuator_glue.cli._heap import give_back

def pages():
    return int(open('/proc/self/statm').read().split()[1])

trim = give_back([range(int(sys.argv[1]))])
large = np.ones(30 << 17)
del large  # from now on the heap keeps what is as large
held = [*(np.ones(1 << 21) for _ in range(8)), bytearray(100_000)]
before = pages()
del held[:8]
print(before - pages())
small = [bytearray(50_000) for _ in range(2000)]
before, last = pages(), small[-1]
del small
trim()
print(before - pages())
"""


@pytest.mark.skipif(platform.libc_ver()[0] != 'glibc', reason='other C libraries are not asked')
def test_freed_arrays_go_back_where_records_are_long() -> None:
    """128 MiB below a small block: 32 768 pages; 100 MB of small ones below one that stays."""
    run = [sys.executable, '-c', CODE, '6000000']
    found = subprocess.run(run, capture_output=True, text=True, check=True, timeout=60)
    large, small = map(int, found.stdout.split())
    assert large > 30_000 and small > 20_000


def test_the_heap_of_short_records_is_left_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """What it keeps then is up to the C library."""
    asked: list[object] = []
    monkeypatch.setattr(_heap.ctypes, 'CDLL', asked.append)
    _heap.give_back([Record(np.zeros(60_000), np.zeros(60_000), 1e-3)])()
    assert not asked
