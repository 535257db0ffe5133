"""Nodes forked from a process that holds their libraries: those take most of a node's start.

The executables themselves are started where starts and signals are tested (`installed=True`).
"""

import multiprocessing
import os
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

from actuator_glue.nodes import parameter_file, run

_CONTEXT = multiprocessing.get_context('forkserver')
_CONTEXT.set_forkserver_preload(
    ['rclpy', *(f'actuator_glue.nodes.{node}' for node in (*parameter_file.NODES, 'suite'))]
)


def _node(name, arguments, folder, log, environment):
    """What the executable does, in a session of its own."""
    os.setsid()
    os.chdir(folder)
    os.environ.clear()
    os.environ.update(environment)
    with Path(log).open('ab') as file:
        for stream in sys.stdout, sys.stderr:
            os.dup2(file.fileno(), stream.fileno())
    sys.argv = [name, *arguments]
    sys.exit(getattr(run, name)())


class Forked:
    """A node as `subprocess.Popen` would have it."""

    def __init__(self, name, arguments, folder, log):
        self._process = _CONTEXT.Process(
            target=_node, args=(name, arguments, str(folder), str(log), dict(os.environ))
        )
        self._process.start()
        self.pid = self._process.pid

    @property
    def returncode(self):
        """Its exit status, None while it runs."""
        return self._process.exitcode

    def poll(self):
        """Return its exit status, None while it runs."""
        return self._process.exitcode

    def wait(self, timeout=None):
        """Wait for its end; return the exit status."""
        self._process.join(timeout)
        if self._process.exitcode is None:
            raise subprocess.TimeoutExpired(self._process.name, timeout or 0.0)
        return self._process.exitcode

    def send_signal(self, number):
        """Send a signal, unless it has ended."""
        if self._process.exitcode is None:
            with suppress(ProcessLookupError):
                os.kill(self.pid, number)

    def kill(self):
        """End it at once."""
        self.send_signal(signal.SIGKILL)
