"""Room on the disk that a file has before it is written: its end fits when the disk is full."""

from __future__ import annotations

import ctypes
import errno
import os
from typing import Any

_KEEP_SIZE = 1  # FALLOC_FL_KEEP_SIZE: the file does not look longer than what is written
_FULL = (errno.ENOSPC, errno.EDQUOT)


def reserve(file: int, start: int, length: int) -> None:
    """Have the disk keep room for bytes of an open file; truncating the file gives it back.

    Python's `os.posix_fallocate` would fill the file with zeros, which a killed process leaves.
    A file system that cannot reserve says so when it is written.

    Raises:
        OSError: the disk or the quota has no room (ENOSPC, EDQUOT).
    """
    fallocate: Any = getattr(ctypes.CDLL(None, use_errno=True), 'fallocate', None)
    if fallocate is None:
        return
    fallocate.argtypes = (ctypes.c_int, ctypes.c_int, ctypes.c_int64, ctypes.c_int64)
    if fallocate(file, _KEEP_SIZE, start, length) and ctypes.get_errno() in _FULL:
        raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))
