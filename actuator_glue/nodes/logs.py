"""Where ROS writes its logs: where it can, or nowhere; a node starts all the same."""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import MutableMapping, Sequence
from contextlib import suppress
from pathlib import Path

# Of ROS: log to the screen and to /rosout alone.
NO_FILES = '--disable-external-lib-logs'


def arranged(
    args: Sequence[str] | None, environment: MutableMapping[str, str] = os.environ
) -> Sequence[str] | None:
    """Return the command line for rclpy, once there is a folder for its logs or none is needed.

    rclpy refuses to start where it cannot make its folder: without HOME, or on a read-only disk.

    Args:
        args: the command line; None for the process's own.
        environment: what rclpy will read.
    """
    wanted = _wanted(environment)
    if wanted is not None and _writable(wanted):
        return args
    why = 'no home folder is known' if wanted is None else f'{wanted} cannot be written'
    # OSError: not even a folder for temporary files can be written.
    with suppress(OSError):
        folder = Path(tempfile.gettempdir(), f'ros_log_{os.getuid()}')
        if _writable(folder):
            environment['ROS_LOG_DIR'] = str(folder)
            print(f'logs go to {folder}: {why}', file=sys.stderr)
            return args
    print(f'logs go to the screen alone: {why}', file=sys.stderr)
    given = list(sys.argv if args is None else args)
    return [*given, *([] if '--ros-args' in given else ['--ros-args']), NO_FILES]


def _wanted(environment: MutableMapping[str, str]) -> Path | None:
    """Return the folder that ROS would take."""
    if environment.get('ROS_LOG_DIR'):
        return Path(environment['ROS_LOG_DIR'])
    if environment.get('ROS_HOME'):
        return Path(environment['ROS_HOME'], 'log')
    return Path(environment['HOME'], '.ros', 'log') if environment.get('HOME') else None


def _writable(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False
