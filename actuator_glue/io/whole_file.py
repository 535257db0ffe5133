"""Files that are written in one step: there is all of one, or nothing."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from actuator_glue.errors import InputError


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Yield a file beside `path` that takes its name once it is complete and on the disk.

    Raises:
        InputError: it cannot be written.
    """
    temporary = path.with_name(path.name + '.tmp')
    try:
        yield temporary
        with temporary.open('rb') as written:
            os.fsync(written.fileno())
        temporary.replace(path)
    except OSError as error:
        raise InputError(f'{path}: cannot be written ({error.strerror or error})') from error
    finally:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)
