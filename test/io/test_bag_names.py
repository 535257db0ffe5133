"""Channels of bags that are chosen by their name: no order of a list says which they are."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from actuator_glue.cli.main import main
from actuator_glue.errors import InputError
from actuator_glue.io.bag_topics import topic_series
from actuator_glue.io.channel_map import ChannelMap, parse_channel_map
from actuator_glue.io.load import load, load_records

ROOT = Path(__file__).resolve().parents[2]
COUNT = 400
START = 1_700_000_000_000_000_000
COMMAND = np.sin(0.1 * np.arange(COUNT))
MEASURED = np.sin(0.1 * np.arange(COUNT) - 0.3)
OTHER = np.cos(0.2 * np.arange(COUNT))
STORE = get_typestore(Stores.ROS2_JAZZY)
STORE.register(
    {
        **get_types_from_msg(
            'std_msgs/Header header\nstring[] joint_names\nlab_msgs/Point reference\n',
            'lab_msgs/msg/State',
        ),
        **get_types_from_msg('float64[] positions\nfloat64[] effort\n', 'lab_msgs/msg/Point'),
        **get_types_from_msg('string[] interface_names\nfloat64[] values\n', 'lab_msgs/msg/Joint'),
        **get_types_from_msg(
            'std_msgs/Header header\nstring[] joint_names\nlab_msgs/Joint[] interface_values\n',
            'lab_msgs/msg/Dynamic',
        ),
    }
)
TYPES = STORE.types
KINDS = {
    'joints': 'sensor_msgs/msg/JointState',
    'nested': 'lab_msgs/msg/State',
    'dynamic': 'lab_msgs/msg/Dynamic',
}
PATHS = {
    'joints': 'position[{}]',
    'nested': 'reference.positions[{}]',
    'dynamic': 'interface_values[{}].values[position]',
}


def content(kind: str, at: int, names: list[str]) -> Any:
    """Return message number `at` whose joints come in the order of `names`."""
    values = {'act1': MEASURED[at], 'act2': OTHER[at]}
    position, empty = np.array([values[name] for name in names]), np.empty(0)
    stamp = TYPES['builtin_interfaces/msg/Time'](*divmod(START + at * 1_000_000, 10**9))
    header = TYPES['std_msgs/msg/Header'](stamp=stamp, frame_id='')
    if kind == 'joints':
        return TYPES[KINDS[kind]](header, names, position, empty, empty)
    if kind == 'nested':
        return TYPES[KINDS[kind]](header, names, TYPES['lab_msgs/msg/Point'](position, empty))
    inner = ['velocity', 'position'] if at % 2 else ['position', 'velocity']
    joints = [
        TYPES['lab_msgs/msg/Joint'](
            inner, np.array([p, 7.0] if inner[0] == 'position' else [7, p])
        )
        for p in position
    ]
    return TYPES[KINDS[kind]](header, names, joints)


def write(path: Path, kind: str, names: Any) -> Path:
    """Write a bag of a command and of joints; `names` gives their order by message."""
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        command = writer.add_connection('/command', KINDS['joints'], typestore=STORE)
        joints = writer.add_connection('/joints', KINDS[kind], typestore=STORE)
        for at in range(COUNT):
            stamp = START + at * 1_000_000
            sent = content('joints', at, ['act1'])
            sent.position = COMMAND[at : at + 1]
            writer.write(command, stamp, STORE.serialize_cdr(sent, KINDS['joints']))
            data = STORE.serialize_cdr(content(kind, at, names(at)), KINDS[kind])
            writer.write(joints, stamp, data)
    return path


def steady(at: int) -> list[str]:
    """Return the same order always."""
    return ['act1', 'act2']


def turned(at: int) -> list[str]:
    """Return another order from message 280 on."""
    return ['act1', 'act2'] if at < 280 else ['act2', 'act1']


def mapped(measured: str) -> ChannelMap:
    """Return a channel map in mm."""
    command = {'column': '/command.position[act1]', 'unit': 'mm'}
    content = {'command': command, 'measured': {'column': measured, 'unit': 'mm'}}
    return parse_channel_map(content, 'map')


@pytest.mark.parametrize('names', [steady, turned])
@pytest.mark.parametrize('kind', KINDS)
def test_a_joint_is_found_by_its_name_in_every_message(
    tmp_path: Path, kind: str, names: Any
) -> None:
    """Whatever the order of the names: of the message, and of messages within it."""
    path = write(tmp_path / 'bag', kind, names)
    column = f'/joints.{PATHS[kind].format("act1")}'
    assert np.array_equal(load(path, channels=mapped(column)).measured, 1e-3 * MEASURED)
    offered = topic_series(path)['/joints'].names()
    assert column in offered and not any('[0]' in name for name in offered)


@pytest.mark.parametrize('kind', KINDS)
def test_a_joint_asked_for_by_its_number_is_refused_where_names_turn(
    tmp_path: Path, kind: str
) -> None:
    """The message says by which name; where names stay, a number is as good."""
    column = f'/joints.{PATHS[kind].format(0)}'
    path = write(tmp_path / 'bag', kind, turned)
    with pytest.raises(InputError) as told:
        load(path, channels=mapped(column))
    assert "'act1' in the first message and 'act2' in message 280" in str(told.value)
    assert str(told.value).endswith(f'/joints.{PATHS[kind].format("act1")}')
    path = write(tmp_path / 'steady', kind, steady)
    assert np.array_equal(load(path, channels=mapped(column)).measured, 1e-3 * MEASURED)


def test_a_joint_that_a_message_lacks_is_refused(tmp_path: Path) -> None:
    """With its message; a name that no message has, with what there is."""
    path = write(tmp_path / 'bag', 'joints', lambda at: ['act1', 'act2'][: 1 + (at != 33)])
    with pytest.raises(InputError, match=r'message 33 has no position\[act2\]'):
        load(path, channels=mapped('/joints.position[act2]'))
    with pytest.raises(InputError, match=r'it holds .*position\[act1\]'):
        load(path, channels=mapped('/joints.position[act3]'))
    assert topic_series(path)['/joints'].names() == ['/joints.position[act1]']


@pytest.mark.parametrize('bag', sorted(p.name for p in (ROOT / 'bags').glob('*/')))
def test_map_info_and_convert_take_every_bag_of_this_project(
    tmp_path: Path, bag: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """Arrays of our own results have another length in each message; no map is proposed."""
    path = str(ROOT / 'bags' / bag)
    assert main(['map', path]) == 0
    shown = capsys.readouterr().out
    assert 'needs no channel map' in shown and 'Proposed' not in shown
    assert main(['info', path]) == 0
    assert main(['convert', path, str(tmp_path / 'a.csv')]) == 0
    assert load_records(path)
