"""Files that others find whole or not at all, whoever else writes them at the same time."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path


def write_whole(path: Path, write: Callable[[Path], object]) -> None:
    """Have a file written under a name that nobody else has, and put it in its place in one step.

    Args:
        path: of the file; folders are made.
        write: writes to the path that it is given, which has the same suffix.

    Raises:
        OSError: the folder cannot be written.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f'part-{os.getpid()}-{os.urandom(4).hex()}-{path.name}')
    try:
        write(part)
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)
