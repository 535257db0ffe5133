"""How DDS carries messages where the user has not chosen: a killed node is soon replaced.

Fast DDS's shared memory goes on writing into what a killed process left behind, and a node that
is started in its place hears nothing for 3 to 12 s; over UDP it hears within half a second as a
rule (docs/dds.md).
"""

from __future__ import annotations

import os
from collections.abc import MutableMapping
from pathlib import Path

# Whoever sets one of these has chosen.
CHOICES = (
    'FASTDDS_BUILTIN_TRANSPORTS',
    'FASTDDS_DEFAULT_PROFILES_FILE',
    'FASTRTPS_DEFAULT_PROFILES_FILE',
    'ROS_STATIC_PEERS',
    'ROS_LOCALHOST_ONLY',
)
RANGE = 'ROS_AUTOMATIC_DISCOVERY_RANGE'


def choose(environment: MutableMapping[str, str] = os.environ) -> None:
    """Choose UDP, quick repeats and announcements, before rclpy is initialised.

    Args:
        environment: what rclpy and Fast DDS will read.
    """
    other = environment.get('RMW_IMPLEMENTATION', 'rmw_fastrtps_cpp') != 'rmw_fastrtps_cpp'
    if other or any(environment.get(name) for name in CHOICES):
        return
    local = environment.get(RANGE, '').upper() == 'LOCALHOST'
    if local:
        # With LOCALHOST rmw_fastrtps adds shared memory whatever a profile says; the profile
        # keeps to the loopback device as well.
        environment[RANGE] = 'SYSTEM_DEFAULT'
    else:
        environment['FASTDDS_BUILTIN_TRANSPORTS'] = 'UDPv4'
    profile = 'dds_local.xml' if local else 'dds_network.xml'
    environment['FASTRTPS_DEFAULT_PROFILES_FILE'] = str(Path(__file__).with_name(profile))
