"""Where files without a given name go: beside ROS's own logs, not to the working folder."""

from __future__ import annotations

import os
import time
from pathlib import Path


def unnamed(kind: str, suffix: str = '') -> Path:
    """Return a path for a file or bag without a name, `~/.ros/actuator_glue/KIND_DATE-TIME`.

    Args:
        kind: what it is.
        suffix: end of its name.
    """
    home = Path(os.environ.get('ROS_HOME') or '~/.ros').expanduser()
    return home / 'actuator_glue' / (time.strftime(f'{kind}_%Y_%m_%d-%H_%M_%S') + suffix)
