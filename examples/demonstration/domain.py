"""A ROS domain that nobody else on this machine uses."""

from __future__ import annotations

import fcntl
import os
import socket
import tempfile
from itertools import chain
from pathlib import Path
from typing import IO

from actuator_glue.errors import InputError

# Linux: up to 101 domains leave the ephemeral ports alone.
DOMAINS = range(1, 102)
# Locks live as long as the process that holds them.
_held: list[IO[str]] = []


def own_domain() -> None:
    """Keep nodes to this machine, in a domain of their own unless the user has set one."""
    os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    if 'ROS_DOMAIN_ID' not in os.environ:
        os.environ['ROS_DOMAIN_ID'] = str(free_domain())


def free_domain() -> int:
    """Return a domain without a participant on this machine; it is ours while we live.

    Raises:
        InputError: all are taken.
    """
    # Where others begin elsewhere, few look at the same domain.
    begin = os.getpid() % len(DOMAINS)
    for domain in chain(DOMAINS[begin:], DOMAINS[:begin]):
        if _locked(domain):
            if not _inhabited(domain):
                return domain
            _held.pop().close()
    raise InputError(
        f'ROS domains {DOMAINS[0]} to {DOMAINS[-1]} are all in use on this machine; '
        'choose one with ROS_DOMAIN_ID'
    )


def _locked(domain: int) -> bool:
    """Lock a domain against others who choose as we do; return whether it was free."""
    path = Path(tempfile.gettempdir(), f'actuator_glue_ros_domain_{domain}.lock')
    try:
        lock = path.open('a')
    except OSError:  # somebody else's file
        return False
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        lock.close()
        return False
    _held.append(lock)
    return True


def _inhabited(domain: int) -> bool:
    """Whether a participant listens at one of the first ports of a domain (RTPS 2.5, 9.6.2.3)."""
    for offset in (0, 10, 12, 14, 16):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            try:
                probe.bind(('', 7400 + 250 * domain + offset))
            except OSError:
                return True
    return False
