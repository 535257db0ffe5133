"""Authentic messages: HMAC-SHA256 behind each, by a key that both sides have."""

from __future__ import annotations

import hmac
import stat
from pathlib import Path

from actuator_glue.errors import InputError

SIZE = 32  # bytes
SHORTEST, LONGEST = 16, 4096  # bytes of a key


class Seal:
    """Signs and checks messages by a key that sender and receiver share."""

    def __init__(self, key: bytes) -> None:
        self._key = key

    def sign(self, payload: bytes) -> bytes:
        """Return the 32 bytes that go behind a payload."""
        return hmac.digest(self._key, payload, 'sha256')

    def opened(self, message: bytes) -> bytes | None:
        """Return the payload of a signed message, None where the signature is not ours."""
        payload, tag = message[:-SIZE], message[-SIZE:]
        return payload if hmac.compare_digest(self.sign(payload), tag) else None

    def opened_line(self, line: bytes) -> bytes | None:
        """Return a line without the blank and 64 hexadecimal digits at its end, or None."""
        payload, _, tag = line.rpartition(b' ')
        given = self.sign(payload).hex().encode()
        return payload if hmac.compare_digest(given, tag.lower()) else None


def read_key(path: Path | str) -> Seal:
    """Return the seal of a key file; white space at its end does not count.

    Raises:
        InputError: the file cannot be read, others can read it, or the key is too short.
    """
    path = Path(path)
    try:
        with path.open('rb') as file:
            mode = path.stat().st_mode
            key = file.read(LONGEST + 1).rstrip()
    except OSError as error:
        raise InputError(f'{path}: key file cannot be read ({error.strerror})') from error
    if mode & (stat.S_IRGRP | stat.S_IROTH):
        raise InputError(f'{path}: others can read this key; protect it with chmod 600 {path}')
    if not SHORTEST <= len(key) <= LONGEST:
        raise InputError(
            f'{path}: a key has {SHORTEST} to {LONGEST} bytes, this one {len(key)}; make one '
            'with: openssl rand -hex 32'
        )
    return Seal(key)
