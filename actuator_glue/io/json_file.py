"""Results as JSON, to a file or to standard output."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

from actuator_glue.json_value import json_value
from actuator_glue.whole_file import whole_file


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
    with whole_file(Path(out)) as temporary:
        temporary.write_text(text, 'utf-8')
