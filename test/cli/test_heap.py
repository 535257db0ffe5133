"""Memory of long records goes back to the system."""

import platform
import subprocess
import sys

import pytest

CODE = """
import sys
import numpy as np
from actuator_glue.cli._heap import give_back

def pages():
    return int(open('/proc/self/statm').read().split()[1])

give_back([range(int(sys.argv[1]))])
large = np.ones(30 << 17)
del large  # from now on the heap keeps what is as large
held = [*(np.ones(1 << 21) for _ in range(8)), bytearray(100_000)]
before = pages()
del held[:8]
print(before - pages())
"""


@pytest.mark.skipif(platform.libc_ver()[0] != 'glibc', reason='other C libraries are not asked')
@pytest.mark.parametrize(('samples', 'returned'), [(60_000, False), (6_000_000, True)])
def test_freed_arrays_go_back_where_records_are_long(samples: int, returned: bool) -> None:
    """128 MiB below a small block: 32 768 pages."""
    run = [sys.executable, '-c', CODE, str(samples)]
    found = subprocess.run(run, capture_output=True, text=True, check=True, timeout=60)
    assert (int(found.stdout) > 30_000) is returned
