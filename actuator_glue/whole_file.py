"""Files written in one step: others find all of one, or nothing, whoever else writes it."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from actuator_glue.errors import InputError

# Where names stand for what is open already, /dev/stdout say.
_OPENED = ('/', 'dev'), ('/', 'proc')


@contextmanager
def replaced(path: Path) -> Iterator[Path]:
    """Yield a name beside `path` that nobody else has; the file takes its place once it is there.

    It has the suffix of `path`, by which libraries know what to write.

    Raises:
        OSError: it cannot be written.
    """
    part = path.with_name(f'part-{os.getpid()}-{os.urandom(4).hex()}-{path.name}')
    try:
        yield part
        with part.open('rb') as written:
            os.fsync(written.fileno())
        with suppress(OSError):  # who may read what was there may read this
            part.chmod(path.stat().st_mode & 0o777)
        part.replace(path)
    finally:
        with suppress(OSError):
            part.unlink(missing_ok=True)


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Yield a file that takes the name `path` once it is complete and on the disk.

    Its folder is made. What was there stays where writing fails; a link stays a link, and a
    device or pipe is written as it is.

    Raises:
        InputError: it cannot be written.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        if path.exists() and (not path.is_file() or path.parts[:2] in _OPENED):
            yield path
            return
        with replaced(path.resolve()) as part:
            yield part
    except OSError as error:
        raise InputError(f'{path}: cannot be written ({error.strerror or error})') from error
