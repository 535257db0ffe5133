"""Whether a computer is ready for live tests: each function is one question."""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Literal, TypeAlias

Verdict: TypeAlias = Literal['ok', 'advice', 'missing']

# A child that imports rclpy or numba on a slow disk takes this long at most [s].
PATIENCE = 60.0
# A warm cache answers within this [s]; compiling takes one to four minutes.
WARM_SECONDS = 25.0
# A recorder at 1 kHz writes 0.05 MB/s, at 10 kHz half a MB/s; bags of long tests are gigabytes.
DISK_SPEED, DISK_FREE, DISK_STALL = 5e6, 1e9, 0.5  # B/s, B, s
DISK_TRIAL = 32 << 20  # bytes
RECEIVE_BUFFER = 4 << 20  # bytes
DDS_SLOW = 0.01  # s


@dataclass(frozen=True, slots=True)
class Check:
    """One answer.

    Attributes:
        name: of the check.
        verdict: ok; advice where it works but could be better; missing where it does not.
        text: what was found.
        remedy: what to do, empty where nothing is to be done.
    """

    name: str
    verdict: Verdict
    text: str
    remedy: str = ''


def examine(folder: Path) -> Iterator[Check]:
    """Yield the answers one by one; none depends on whether the machine has ROS.

    Args:
        folder: where bags will be written.
    """
    checks: tuple[Callable[[], Check], ...] = (
        ros,
        messages,
        dds,
        compiled,
        realtime,
        receive_buffer,
        partial(disk, folder),
    )
    for check in checks:
        try:
            yield check()
        except Exception as error:  # a check that fails is an answer, not the end of the others
            text = f'could not be looked at ({type(error).__name__}: {error})'
            yield Check(getattr(check, '__name__', 'disk'), 'missing', text)


def ros() -> Check:
    """Whether rclpy can be imported, and whose it is."""
    code = 'import rclpy, os; print(rclpy.__file__, os.environ.get("ROS_DISTRO") or "wheels")'
    done = _python('-c', code)
    if done.returncode:
        remedy = (
            'source ROS 2 (. /opt/ros/jazzy/setup.bash), or `make setup` and . install/setup.bash'
        )
        return Check('ros', 'missing', _last(done.stderr), remedy)
    return Check('ros', 'ok', f'rclpy, {done.stdout.split()[-1]}')


def messages() -> Check:
    """Whether the message package is built and on the path."""
    done = _python('-c', 'from actuator_glue_msgs.msg import SampleBlock; SampleBlock()')
    if done.returncode:
        remedy = '`make setup` or colcon build, then . install/setup.bash in this shell'
        return Check('messages', 'missing', _last(done.stderr), remedy)
    return Check('messages', 'ok', 'actuator_glue_msgs is on the path')


def dds() -> Check:
    """Whether messages pass between two participants of this machine, and how fast."""
    remedy = 'look at ROS_DOMAIN_ID, ROS_AUTOMATIC_DISCOVERY_RANGE and the firewall; docs/dds.md'
    done = _python('-m', 'actuator_glue.nodes.loopback')
    if done.returncode:
        return Check('dds', 'missing', _last(done.stderr), remedy)
    found = json.loads(done.stdout.splitlines()[-1])
    if found['received'] < found['sent']:
        text = f'{found["received"]} of {found["sent"]} messages arrived'
        return Check('dds', 'missing', text, remedy)
    text = (
        f'{found["received"]} of {found["sent"]} messages, {1e3 * found["median"]:.2f} ms median, '
        f'found each other in {found["discovery"]:.1f} s'
    )
    slow = found['median'] > DDS_SLOW
    return Check('dds', 'advice' if slow else 'ok', text, remedy if slow else '')


def compiled() -> Check:
    """Whether the estimator starts at once, or compiles first."""
    kept = _python('-c', 'from actuator_glue.jit import STORE; print(STORE.told())')
    if kept.returncode:
        return Check('compiled', 'missing', _last(kept.stderr), 'pip install actuator_glue')
    began = time.monotonic()
    code = 'from actuator_glue.workers.warm import warm_windows; warm_windows(swap=False)'
    try:
        done = _python('-c', code, patience=WARM_SECONDS)
    except subprocess.TimeoutExpired:
        text = f'cold: the estimator was not ready after {WARM_SECONDS:g} s'
        if kept.stdout.strip():
            text = f'{text}; {kept.stdout.strip()}'
        remedy = 'start the estimator once and wait for "ready", a few minutes (`make setup` does)'
        return Check('compiled', 'advice', text, remedy)
    if done.returncode:
        return Check('compiled', 'missing', _last(done.stderr), 'pip install actuator_glue')
    return Check('compiled', 'ok', f'warm: ready in {time.monotonic() - began:.1f} s')


def realtime() -> Check:
    """Whether processes of this user may ask for a realtime priority."""
    soft, _ = resource.getrlimit(resource.RLIMIT_RTPRIO)
    # Asked for in a child: this process stays as it is.
    done = _python('-c', 'import os; os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))')
    if done.returncode == 0:
        return Check('realtime', 'ok', f'granted (rtprio limit {soft})')
    return Check(
        'realtime',
        'advice',
        f'not granted (rtprio limit {soft}); nodes run at normal priority',
        'add "@realtime - rtprio 98" to /etc/security/limits.d/realtime.conf and join that group',
    )


def receive_buffer() -> Check:
    """Whether datagrams can wait while the computer does something else."""
    path = Path('/proc/sys/net/core/rmem_max')
    granted = int(path.read_text())
    if granted >= RECEIVE_BUFFER:
        return Check('receive_buffer', 'ok', f'{granted / 1e6:.1f} MB for live streams by UDP')
    return Check(
        'receive_buffer',
        'advice',
        f'{granted / 1e6:.2f} MB: 10 kHz outlast a stall of {granted / 768 / 10_000:.2g} s',
        f'sudo sysctl -w net.core.rmem_max={RECEIVE_BUFFER}',
    )


def disk(folder: Path) -> Check:
    """How fast the folder of bags can be written, and how much room it has."""
    while not folder.exists():
        folder = folder.parent
    piece, worst = os.urandom(1 << 20), 0.0
    try:
        with tempfile.NamedTemporaryFile(dir=folder) as file:
            began = time.monotonic()
            for _ in range(DISK_TRIAL // len(piece)):
                before = time.monotonic()
                file.write(piece)
                file.flush()
                os.fsync(file.fileno())
                worst = max(worst, time.monotonic() - before)
            speed = DISK_TRIAL / (time.monotonic() - began)
            room = os.statvfs(folder)
    except OSError as error:
        text = f'{folder}: {error.strerror}'
        return Check('disk', 'missing', text, 'name another folder with --bags')
    free = room.f_bavail * room.f_frsize
    text = (
        f'{folder}: {speed / 1e6:.0f} MB/s, slowest MB {1e3 * worst:.0f} ms, '
        f'{free / 1e9:.0f} GB free'
    )
    slow = speed < DISK_SPEED or free < DISK_FREE or worst > DISK_STALL
    remedy = 'record to a faster or emptier disk' if slow else ''
    return Check('disk', 'advice' if slow else 'ok', text, remedy)


def _python(*args: str, patience: float = PATIENCE) -> subprocess.CompletedProcess[str]:
    process = subprocess.Popen(
        [sys.executable, *args], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    try:
        out, err = process.communicate(timeout=patience)
    except subprocess.TimeoutExpired:
        process.kill()
        with suppress(subprocess.TimeoutExpired):  # its own children may keep the pipe open
            process.communicate(timeout=5.0)
        raise
    return subprocess.CompletedProcess(args, process.returncode, out, err)


def _last(text: str) -> str:
    lines = [line for line in text.splitlines() if line.strip()]
    return lines[-1].strip() if lines else 'no answer'
