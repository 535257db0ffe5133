"""How a result was made: version, date, seed, hashes of what was read."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from datetime import UTC, datetime
from pathlib import Path

from actuator_glue import __version__
from actuator_glue.records import Record


def provenance(records: Iterable[Record], seed: int) -> dict[str, str]:
    """Return version, date, seed and the SHA-256 of every record.

    Of the file that a record says it comes from; of its command and displacement where there is
    no such file (any more).
    """
    out = {
        'version': f'actuator_glue {__version__}',
        'date': datetime.now(UTC).isoformat(timespec='seconds'),
        'seed': str(seed),
    }
    for i, record in enumerate(records):
        path = Path(record.source) if record.source else None
        if path is not None and path.is_file():
            with path.open('rb') as file:
                digest, what = hashlib.file_digest(file, 'sha256'), 'file'
        else:
            content = record.command.tobytes() + record.measured.tobytes()
            digest, what = hashlib.sha256(content), 'samples'
        name = record.source or f'record {i + 1}'
        out[f'sha256 of {name}'] = f'{digest.hexdigest()} ({what})'
    return out
