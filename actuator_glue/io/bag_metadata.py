"""metadata.yaml of a rosbag2 bag, version 9, as `ros2 bag record` writes it."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml
from rosbags.interfaces import QosDurability, QosHistory, QosLiveliness, QosReliability

from actuator_glue.errors import InputError
from actuator_glue.io.disk_room import reserve
from actuator_glue.plain_yaml import plain_yaml

NAME = 'metadata.yaml'
_TEMPORARY = NAME + '.tmp'
ROOM_BYTES = 64 * 1024  # of metadata of a hundred topics and files
_FOREVER = {'sec': 9223372036, 'nsec': 854775807}


@dataclass(frozen=True, slots=True)
class Qos:
    """Quality of service a topic was offered with; names as ROS 2 prints them."""

    reliability: str = 'reliable'
    durability: str = 'volatile'
    history: str = 'unknown'
    depth: int = 0

    def as_dict(self) -> dict[str, Any]:
        """Return the nine entries that rosbag2 stores."""
        return {
            'history': self.history,
            'depth': self.depth,
            'reliability': self.reliability,
            'durability': self.durability,
            'deadline': dict(_FOREVER),
            'lifespan': dict(_FOREVER),
            'liveliness': 'automatic',
            'liveliness_lease_duration': dict(_FOREVER),
            'avoid_ros_namespace_conventions': False,
        }


LATCHED = Qos(durability='transient_local')

# By the number of each in rmw, which bags before version 9 (before Jazzy) hold.
_POLICIES = {
    name: [policy.name.lower() for policy in kind]
    for name, kind in (
        ('history', QosHistory),
        ('reliability', QosReliability),
        ('durability', QosDurability),
        ('liveliness', QosLiveliness),
    )
}


def qos_profiles(text: str) -> list[dict[str, Any]]:
    """Return QoS profiles from the text inside an .mcap, of any version, as version 9 has them.

    What cannot be understood is left out: a bag is worth reading without it.
    """
    try:
        loaded = plain_yaml(text, 'QoS', quick=True)
    except (yaml.YAMLError, ValueError):
        return []
    profiles = []
    for entry in loaded if isinstance(loaded, list) else []:
        if not isinstance(entry, dict):
            continue
        profile = Qos().as_dict()
        for name, default in profile.items():
            value = entry.get(name)
            if name in _POLICIES:
                names = _POLICIES[name]
                if isinstance(value, int) and 0 <= value < len(names):
                    value = names[value]
                profile[name] = value if value in names else 'unknown'
            elif type(value) is type(default):
                profile[name] = value
        profiles.append(profile)
    return profiles


@dataclass(slots=True)
class BagTopic:
    """One topic of a bag; `type` is empty where what it carries has no schema."""

    name: str
    type: str
    rihs01: str
    qos: list[dict[str, Any]]
    count: int = 0
    encoding: str = 'cdr'

    @property
    def key(self) -> tuple[str, str, str]:
        """Key of the topic: one name may stand for several types."""
        return self.name, self.type, self.encoding


@dataclass(slots=True)
class BagFile:
    """One file of a bag: name, first and last log time [ns], number of messages."""

    name: str
    start: int = 0
    stop: int = 0
    count: int = 0

    def add(self, log_time: int) -> None:
        """Count one message."""
        self.start = min(self.start, log_time) if self.count else log_time
        self.stop = max(self.stop, log_time)
        self.count += 1


@dataclass(slots=True)
class Metadata:
    """What metadata.yaml says."""

    topics: list[BagTopic] = field(default_factory=list)
    parts: list[BagFile] = field(default_factory=list)
    ros_distro: str = 'jazzy'

    def information(self) -> dict[str, Any]:
        """Return the mapping below `rosbag2_bagfile_information`."""
        filled = [p for p in self.parts if p.count]
        start = min((p.start for p in filled), default=0)
        stop = max((p.stop for p in filled), default=0)
        return {
            'version': 9,
            'storage_identifier': 'mcap',
            'duration': {'nanoseconds': stop - start},
            'starting_time': {'nanoseconds_since_epoch': start},
            'message_count': sum(p.count for p in self.parts),
            'topics_with_message_count': [
                {
                    'topic_metadata': {
                        'name': t.name,
                        'type': t.type,
                        'serialization_format': t.encoding,
                        'offered_qos_profiles': t.qos,
                        'type_description_hash': t.rihs01,
                    },
                    'message_count': t.count,
                }
                for t in self.topics
            ],
            'compression_format': '',
            'compression_mode': '',
            'relative_file_paths': [p.name for p in self.parts],
            'files': [
                {
                    'path': p.name,
                    'starting_time': {'nanoseconds_since_epoch': p.start},
                    'duration': {'nanoseconds': p.stop - p.start},
                    'message_count': p.count,
                }
                for p in self.parts
            ],
            'custom_data': None,
            'ros_distro': self.ros_distro,
        }

    def serialized(self) -> str:
        """Return the text that rosbag2 also keeps inside the .mcap."""
        return str(yaml.safe_dump(self.information(), sort_keys=False))

    def reserve(self, bag: Path) -> None:
        """Have room for metadata.yaml, so that it can be written when the disk is full.

        Raises:
            OSError: there is none.
        """
        room = ROOM_BYTES + 2 * len(self.serialized())
        with (bag / _TEMPORARY).open('ab') as file:
            reserve(file.fileno(), 0, room)

    def write(self, bag: Path) -> None:
        """Write metadata.yaml in one step; its presence says that the bag is finished.

        Raises:
            OSError: it cannot be written.
        """
        content = {'rosbag2_bagfile_information': self.information()}
        temporary = bag / _TEMPORARY
        # Not emptied by opening it, which would give back the room reserved for it.
        with os.fdopen(os.open(temporary, os.O_WRONLY | os.O_CREAT, 0o666), 'wb') as file:
            file.write(yaml.safe_dump(content, sort_keys=False).encode())
            file.flush()
            file.truncate()
            os.fsync(file.fileno())
        temporary.replace(bag / NAME)


def read(bag: Path) -> dict[str, Any] | None:
    """Return what metadata.yaml of a bag says, None where the bag has none.

    Raises:
        InputError: the file is there but is no metadata of a rosbag2 bag.
    """
    path = bag / NAME
    if not path.is_file():
        return None
    try:
        content = plain_yaml(path.read_text('utf-8'), str(path), quick=True)
        information: dict[str, Any] = content['rosbag2_bagfile_information']
        information['relative_file_paths'] = [
            str(name) for name in information['relative_file_paths']
        ]
    except InputError as error:
        raise InputError(f'{error}, or `actuator-glue recover {bag}` writes it anew') from error
    except (OSError, ValueError, yaml.YAMLError, KeyError, TypeError) as error:
        raise InputError(
            f'{path}: this is not the metadata of a rosbag2 bag ({type(error).__name__}); '
            f'`actuator-glue recover {bag}` writes it anew from the data'
        ) from error
    return information
