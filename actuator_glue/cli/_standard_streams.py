"""Standard output and error of a command, which may be closed, full, or read by nobody."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any, TextIO, cast


class StandardStream:
    """A text stream that never ends a command: what cannot be written is dropped from then on.

    A reader that has gone, as in `| head -1`, is no fault: nobody misses what comes after. Any
    other fault, as a full disk, is kept for the end of the command. Files are written and the
    command's own exit code stands either way.

    Args:
        under: the stream; None where it is closed.
        number: its file descriptor.

    Attributes:
        closed_before: the command was started without this stream, as with `>&-`.
        fault: why something could not be written; empty where nothing was in the way.
    """

    def __init__(self, under: TextIO | None, number: int) -> None:
        self.closed_before = under is None
        self.fault = ''
        self._under = _nowhere(number) if under is None else under
        self._gone = False

    def write(self, text: str) -> int:
        """Write a text, or drop it; what its encoding does not have is escaped."""
        if not self._gone:
            try:
                try:
                    self._under.write(text)
                except UnicodeEncodeError as error:  # none of the text was written
                    known = text.encode(error.encoding, 'backslashreplace')
                    self._under.write(known.decode(error.encoding))
            except OSError as error:
                self._give_up(error)
        return len(text)

    def writelines(self, lines: Any) -> None:
        """Write texts, or drop them."""
        self.write(''.join(lines))

    def flush(self) -> None:
        """Hand on what was written."""
        if not self._gone:
            try:
                self._under.flush()
            except OSError as error:
                self._give_up(error)

    def end(self) -> None:
        """Hand on what was written; close what was opened in place of a closed stream.

        Whoever has kept it, as a handler of a log, may write on.
        """
        self.flush()
        if self.closed_before:
            self._gone = True
            self._under.close()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._under, name)

    def _give_up(self, error: OSError) -> None:
        self._gone = True
        if not isinstance(error, BrokenPipeError):
            self.fault = error.strerror or str(error)
        # What the stream still holds is tried again when Python ends: it must go somewhere then.
        with suppress(OSError, ValueError):
            null = os.open(os.devnull, os.O_WRONLY)
            os.dup2(null, self._under.fileno())
            os.close(null)


def _nowhere(number: int) -> TextIO:
    """Open what takes the place of a closed stream, under its number.

    The next file of the command would have that otherwise, and what libraries print would land
    there.
    """
    null = os.open(os.devnull, os.O_WRONLY)
    if null != number and not _is_open(number):  # what is open there by now stays
        os.dup2(null, number)
        os.close(null)
        null = number
    return os.fdopen(null, 'w')


def _is_open(number: int) -> bool:
    try:
        os.fstat(number)
    except OSError:
        return False
    return True


@contextmanager
def standard_streams() -> Iterator[tuple[StandardStream, StandardStream]]:
    """Put a `StandardStream` around standard output and standard error; yield both."""
    before = sys.stdout, sys.stderr
    out, err = StandardStream(before[0], 1), StandardStream(before[1], 2)
    sys.stdout, sys.stderr = cast(TextIO, out), cast(TextIO, err)
    try:
        yield out, err
    finally:
        out.end()
        err.end()
        sys.stdout, sys.stderr = before
