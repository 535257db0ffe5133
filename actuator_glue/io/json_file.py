"""Results as JSON, to a file or to standard output."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

from actuator_glue.errors import InputError
from actuator_glue.io.whole_file import whole_file
from actuator_glue.json_value import json_value


def write_json(content: dict[str, Any], out: str | None) -> None:
    """Write JSON to a file in one step, or to standard output; nothing where `out` is None.

    Raises:
        InputError: the file cannot be written.
    """
    if out is None:
        return
    text = json.dumps(json_value(content), indent=2, allow_nan=False) + '\n'
    if out == '-':
        sys.stdout.write(text)
        return
    path = Path(out)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        if path.exists() and not path.is_file():  # a device or pipe stays what it is
            path.write_text(text, 'utf-8')
            return
    except OSError as error:
        raise InputError(f'{path}: cannot be written ({error.strerror or error})') from error
    with whole_file(path) as temporary:
        temporary.write_text(text, 'utf-8')
