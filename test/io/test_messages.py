"""Wire types without ROS agree with what rosidl generates and rclpy puts on the wire."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

import actuator_glue
from actuator_glue.errors import InputError
from actuator_glue.io import messages
from actuator_glue.io.bag_reader import decoded
from actuator_glue.sample_block import stamp_ns

ROOT = Path(__file__).resolve().parents[2]
GENERATED = ROOT / 'install' / messages.PACKAGE / 'share' / messages.PACKAGE / 'msg'
NAMES = sorted(p.stem for p in messages.definition_folder().glob('*.msg'))


@pytest.mark.ros
@pytest.mark.skipif(not GENERATED.is_dir(), reason='the interface package is not built')
@pytest.mark.parametrize('name', NAMES)
def test_type_hash_is_rosidls(name: str) -> None:
    """The hash in our bags is the one ROS computes, so `ros2 bag play` publishes them."""
    hashes = json.loads((GENERATED / f'{name}.json').read_text())['type_hashes']
    generated = {h['type_name']: h['hash_string'] for h in hashes}
    assert messages.message_type(name).rihs01 == generated[f'{messages.PACKAGE}/msg/{name}']


@pytest.mark.ros
@pytest.mark.parametrize('forces', [0, 1, 2])
@pytest.mark.parametrize('count', [1, 2, 7])
@pytest.mark.parametrize('actuator', ['a', 'abcd', 'abcdefg'])
def test_rclpy_and_we_read_each_other(count: int, forces: int, actuator: str) -> None:
    """What rclpy sends we read, and what we write rclpy reads, arrays empty or not.

    With an empty last array rclpy sends some bytes more than the message needs.
    """
    rclpy = pytest.importorskip('rclpy.serialization', reason='ROS 2 is not installed')
    ours = pytest.importorskip('actuator_glue_msgs.msg', reason='install/ is not sourced')
    sent = ours.SampleBlock(period=1e-3, index=2**40)
    sent.header.stamp.sec, sent.header.stamp.nanosec = 1_700_000_000, 123_456_789
    sent.header.frame_id = actuator
    sent.command = np.linspace(-1, 1, count)
    sent.measured = np.linspace(0, 3, count)
    sent.force = np.linspace(1, 2, forces)
    got = messages.deserialize('SampleBlock', bytes(rclpy.serialize_message(sent)))
    assert stamp_ns(got.header) == 1_700_000_000_123_456_789
    back = rclpy.deserialize_message(messages.serialize('SampleBlock', got), ours.SampleBlock)
    assert back == sent
    for name in ('command', 'measured', 'force'):
        assert getattr(got, name).tobytes() == getattr(sent, name).tobytes()


@pytest.mark.parametrize('name', NAMES)
def test_definitions_carry_their_comments(name: str) -> None:
    """The text in a bag is the .msg file itself, then the types it uses, each once."""
    text = messages.message_type(name).definition
    own = (messages.definition_folder() / f'{name}.msg').read_text()
    assert text.startswith(own.rstrip('\n'))
    titles = [line for line in text.splitlines() if line.startswith('MSG: ')]
    assert len(titles) == len(set(titles))


def test_standard_and_unknown_types() -> None:
    """Types of ROS 2 Jazzy are known by their full name, others are refused."""
    assert messages.message_type('diagnostic_msgs/msg/DiagnosticArray').rihs01.startswith(
        'RIHS01_'
    )
    with pytest.raises(InputError, match='unknown'):
        messages.message_type('Nothing')


def test_types_of_a_laboratorys_own_packages(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A recorder in a sourced workspace can record them; comments stay."""
    folder = tmp_path / 'share' / 'lab_msgs' / 'msg'
    folder.mkdir(parents=True)
    (folder / 'Pump.msg').write_text(
        '# pump\nstd_msgs/Header header\nValve[2] valves\nfloat64 oil # [K]\n'
    )
    (folder / 'Valve.msg').write_text('float64 spool # [m]\nuint8[] bits\n')
    (folder / 'Broken.msg').write_text('float64 [')
    monkeypatch.setenv('AMENT_PREFIX_PATH', str(tmp_path))
    pump = messages.message_type('lab_msgs/msg/Pump')
    assert pump.definition.startswith('# pump')
    assert 'MSG: lab_msgs/Valve\nfloat64 spool # [m]' in pump.definition
    assert pump.rihs01.startswith('RIHS01_')
    with pytest.raises(InputError, match='Broken'):
        messages.message_type('lab_msgs/msg/Broken')


@pytest.mark.parametrize('data', [b'', b'\x00\x01\x00\x00', b'\x00\x07\x00\x00' + bytes(80)])
def test_bytes_that_are_no_message(data: bytes) -> None:
    """Too short, or of an unknown encapsulation."""
    with pytest.raises(InputError, match='SampleBlock'):
        messages.deserialize('SampleBlock', data)


@pytest.mark.parametrize('way', ['package', 'checkout', 'workspace', 'nowhere'])
def test_definitions_are_found_wherever_we_are_installed(tmp_path: Path, way: str) -> None:
    """Inside the package, beside it in a checkout, in a sourced workspace; else one message."""
    package = tmp_path / 'lib' / 'actuator_glue'
    ignore = shutil.ignore_patterns('__pycache__', 'interfaces')
    shutil.copytree(Path(actuator_glue.__file__).parent, package, ignore=ignore)
    source = messages.definition_folder()
    target = {
        'package': package / 'interfaces' / 'msg',
        'checkout': tmp_path / 'lib' / 'msg_defs' / 'msg',
        'workspace': tmp_path / 'ws' / 'share' / messages.PACKAGE / 'msg',
    }.get(way)
    if target is not None:
        shutil.copytree(source, target)
    environment = os.environ | {'PYTHONPATH': str(tmp_path / 'lib')}
    environment['AMENT_PREFIX_PATH'] = str(tmp_path / 'ws')
    code = 'from actuator_glue.io.messages import definition_folder; print(definition_folder())'
    done = subprocess.run(
        [sys.executable, '-c', code],
        env=environment,
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    if target is None:
        assert 'make setup' in done.stderr
    else:
        assert Path(done.stdout.strip()) == target, done.stderr


OLD_EFFECT = 'string name\nfloat64[] mean # [-]\nfloat64[] stddev\nfloat64 size\n'
OLD_DIAGNOSIS = f"""std_msgs/Header header
string verdict
Effect[] effects
float64 seconds
{'=' * 80}
MSG: actuator_glue_msgs/Effect
{OLD_EFFECT}"""


def old_diagnosis() -> bytes:
    """A message of a version that had other fields."""
    store = get_typestore(Stores.ROS2_JAZZY)
    store.register(get_types_from_msg(OLD_DIAGNOSIS, 'actuator_glue_msgs/msg/Diagnosis'))
    effect = store.types['actuator_glue_msgs/msg/Effect'](
        name='delay', mean=np.array([4e-3]), stddev=np.array([1e-5]), size=7.0
    )
    header = messages.header(1_700_000_000_000_000_001, 'rig')
    old = store.types['actuator_glue_msgs/msg/Diagnosis'](
        header=header, verdict='missing-effect', effects=[effect], seconds=2.5
    )
    return bytes(store.serialize_cdr(old, 'actuator_glue_msgs/msg/Diagnosis'))


def test_another_version_of_a_message_is_read() -> None:
    """What it has is kept, what it lacks is not known, nested messages too; never 0 or shifted."""
    data = old_diagnosis()
    found = messages.deserialize('Diagnosis', data, OLD_DIAGNOSIS)
    assert stamp_ns(found.header) == 1_700_000_000_000_000_001
    assert (found.verdict, found.seconds, found.summary) == ('missing-effect', 2.5, '')
    assert np.isnan(found.error_after) and np.isnan(found.noise_floor)
    (effect,) = found.effects
    assert (effect.name, effect.mean.tolist(), effect.stddev.tolist()) == ('delay', [4e-3], [1e-5])
    assert np.isnan(effect.probability) and not hasattr(effect, 'size')
    for name in ('lower', 'upper', 'identified', 'units', 'alternatives'):
        assert len(getattr(effect, name)) == 0
    # As bytes of our own version, for whoever hands on bytes.
    current = messages.as_current('Diagnosis', data, OLD_DIAGNOSIS)
    again = messages.deserialize('Diagnosis', current)
    assert again.effects[0].mean.tolist() == [4e-3] and again.seconds == 2.5
    ours = messages.message_type('Diagnosis').definition
    assert messages.as_current('Diagnosis', current, ours) is current


@pytest.mark.parametrize('text', ['', 'no message [', 'Unknown what'])
def test_a_definition_that_says_nothing_changes_nothing(text: str) -> None:
    """Bytes of our version beside a text that cannot be read are read as ours."""
    block = messages.message(
        'CommandPreview', header=messages.header(5, 'a'), period=1e-3, index=7, command=np.ones(3)
    )
    data = messages.serialize('CommandPreview', block)
    assert messages.deserialize('CommandPreview', data, text).index == 7


def test_bags_of_older_messages_are_read() -> None:
    """This session was recorded before effects had limits and posteriors their doubts."""
    found = list(decoded(ROOT / 'bags' / 'older_session', ('Diagnosis', 'PosteriorMoments')))
    (diagnosis,) = [m for name, m in found if name.endswith('Diagnosis')]
    assert [e.name for e in diagnosis.effects] == ['backlash']
    assert diagnosis.effects[0].mean[0] == pytest.approx(4.06e-5, rel=0.01)
    assert len(diagnosis.effects[0].identified) == 0
    moments = [m for name, m in found if name.endswith('PosteriorMoments')]
    assert len(moments) == 37 and all(110 < m.beta_1_mean < 136 for m in moments[2:])
    assert all(np.isnan(m.prior_p_value) and not m.prior_contradicted for m in moments)
