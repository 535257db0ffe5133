"""Nodes as processes of their own: start, watch, stop in order."""

from __future__ import annotations

import os
import signal
import subprocess
from collections.abc import Mapping
from pathlib import Path
from types import FrameType
from typing import Any, Self

import yaml

from actuator_glue.errors import InputError

PACKAGE = 'actuator_glue'
# A node that is told to stop flushes and says goodbye; longer means that it hangs.
STOP_SECONDS = 15.0


def executable(node: str) -> Path:
    """Return the installed executable of a node, where `ros2 run` would find it.

    Raises:
        InputError: no sourced workspace holds it.
    """
    for prefix in os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep):
        path = Path(prefix, 'lib', PACKAGE, node)
        if prefix and path.is_file():
            return path
    raise InputError(
        f'node {node} of {PACKAGE} is not on AMENT_PREFIX_PATH; run `make demo`, or `make setup` '
        'and `. install/setup.bash` in this shell first'
    )


def end_in_order() -> None:
    """However this process is told to end, let it end as by Ctrl-C: its nodes are then stopped.

    Once only: `make` and a terminal both pass a signal on, and a second one would interrupt
    the stopping and leave nodes behind.
    """
    endings = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)

    def leave(number: int, frame: FrameType | None) -> None:
        for ending in endings:
            signal.signal(ending, signal.SIG_IGN)
        raise KeyboardInterrupt

    for ending in endings:
        signal.signal(ending, leave)


class Node:
    """One running node.

    Args:
        name: executable name.
        parameters: ROS parameters, by name.
        folder: where its parameter file and its log go.

    Raises:
        InputError: the node is not installed.
    """

    def __init__(self, name: str, parameters: Mapping[str, Any], folder: Path) -> None:
        self.name = name
        self.log = folder / f'{name}.log'
        file = folder / f'{name}.yaml'
        file.write_text(
            yaml.safe_dump({'/**': {'ros__parameters': dict(parameters)}}), encoding='utf-8'
        )
        command = [str(executable(name)), '--ros-args', '--params-file', str(file)]
        with self.log.open('wb') as log:
            # A session of its own: Ctrl-C reaches us only, and we stop the nodes in order.
            self.process = subprocess.Popen(
                command, stdout=log, stderr=subprocess.STDOUT, start_new_session=True
            )

    @property
    def running(self) -> bool:
        """Whether the process lives."""
        return self.process.poll() is None

    def last_words(self, lines: int = 8) -> str:
        """Return the end of the node's log."""
        text = self.log.read_text(encoding='utf-8', errors='replace')
        return '\n'.join(text.splitlines()[-lines:])

    def stop(self) -> int:
        """Ask the node to end as Ctrl-C does and return its exit status; kill it if it hangs."""
        if self.running:
            self.process.send_signal(signal.SIGINT)
            try:
                self.process.wait(STOP_SECONDS)
            except subprocess.TimeoutExpired:
                os.killpg(self.process.pid, signal.SIGKILL)
                self.process.wait()
        return self.process.returncode


class Nodes:
    """Nodes that run together; leaving the block stops them, the last started first."""

    def __init__(self) -> None:
        self._nodes: list[Node] = []

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: object, error: object, trace: object) -> None:
        for node in reversed(self._nodes):
            node.stop()

    def start(self, name: str, parameters: Mapping[str, Any], folder: Path) -> Node:
        """Start a node; arguments as `Node`."""
        node = Node(name, parameters, folder)
        self._nodes.append(node)
        return node

    def forget(self, node: Node) -> None:
        """Let go of a node that was ended on purpose."""
        self._nodes.remove(node)

    def check(self) -> None:
        """Say so if a node has died.

        Raises:
            InputError: with the end of its log.
        """
        for node in self._nodes:
            status = node.process.poll()
            if status not in (None, 0):
                raise InputError(
                    f'{node.name} ended with status {status}; its log {node.log} ends with:\n'
                    f'{node.last_words()}'
                )
