"""Where files without a given name go: beside ROS's own logs, not to the working folder."""

from __future__ import annotations

import os
import time
from pathlib import Path

from actuator_glue.errors import InputError


def unnamed(kind: str, suffix: str = '') -> Path:
    """Return a path for a file or bag without a name, `~/.ros/actuator_glue/KIND_DATE-TIME`.

    Args:
        kind: what it is.
        suffix: end of its name.

    Raises:
        InputError: no home folder is known.
    """
    try:
        home = Path(os.environ.get('ROS_HOME') or '~/.ros').expanduser()
    except RuntimeError as error:
        raise InputError(
            f'no home folder is known for a {kind} without a name; name it by a parameter, or let '
            'ROS_HOME name a folder'
        ) from error
    return home / 'actuator_glue' / (time.strftime(f'{kind}_%Y_%m_%d-%H_%M_%S') + suffix)
