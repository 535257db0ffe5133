"""Make the CMake files of the ROS 2 wheels name this machine's Python headers.

The wheels were built with a Python under /opt/python and their exported targets say so. Each file
is replaced, not edited: an installer may have hard-linked it to its cache.
"""

import os
import re
import sys
import sysconfig
import tempfile
from pathlib import Path

import numpy as np

PYTHON_HEADERS = re.compile(r'/opt/python/cp\d+-cp\d+/include/python3\.\d+')
NUMPY_HEADERS = re.compile(r'/opt/python/[^;"]*/numpy/(?:_core|core)/include')


def mend(text: str) -> str:
    """Return the text of a CMake file with the builder's header folders replaced by ours."""
    text = PYTHON_HEADERS.sub(lambda _: sysconfig.get_path('include'), text)
    return NUMPY_HEADERS.sub(lambda _: np.get_include(), text)


def main() -> int:
    """Mend every CMake file below this environment's share folder."""
    for path in sorted(Path(sys.prefix, 'share').rglob('*.cmake')):
        before = path.read_text(encoding='utf-8')
        after = mend(before)
        if '/opt/python' in after:
            print(
                f'{path} still names the machine it was built on; wheels changed?', file=sys.stderr
            )
            return 1
        if after != before:
            handle, temporary = tempfile.mkstemp(dir=path.parent)
            with os.fdopen(handle, 'w', encoding='utf-8') as file:
                file.write(after)
            Path(temporary).chmod(path.stat().st_mode)
            os.replace(temporary, path)  # noqa: PTH105 - os.replace is what the docstring means
    return 0


if __name__ == '__main__':
    sys.exit(main())
