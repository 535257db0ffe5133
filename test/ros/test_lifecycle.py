"""Every node: each transition, each parameter, one clear message for a bad one."""

import math
from pathlib import Path

import pytest
import yaml
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState

from actuator_glue.nodes import parameter_file

ROOT = Path(__file__).resolve().parents[2]
NODES = sorted(parameter_file.NODES)


def needed(node, tmp_path):
    """Parameters without which a node cannot be configured."""
    if node == 'lab_bridge':
        path = tmp_path / 'test.csv'
        rows = ''.join(f'{0.01 * i},{0.001 * i % 1},{0.001 * i % 1}\n' for i in range(500))
        path.write_text('time_s,command_mm,measured_mm\n' + rows)
        return {'file': str(path), 'specimen_stiffness': 1e5, 'wait_for': 99}
    if node == 'replay':
        bags = sorted(p.parent for p in ROOT.glob('bags/**/metadata.yaml'))
        return {'bag': str(bags[0]), 'wait_for': 99}
    if node == 'recorder':
        return {'bag': str(tmp_path / 'bag')}
    if node == 'margin':
        return {'partition': 'sdof'}
    if node == 'viewer':
        return {'port': 0}
    return {'wait_for': 99} if node == 'actuator_sim' else {}


@pytest.mark.parametrize('node', NODES)
def test_every_transition(node, start, probe, tmp_path):
    # One of them as it is installed; what the others' executables are, test_signals.py looks at.
    installed = node == 'actuator_sim'
    process = start(node, autostart=False, installed=installed, **needed(node, tmp_path))
    assert probe.state(node) == 'unconfigured'
    for label, state in (
        ('configure', 'inactive'),
        ('cleanup', 'unconfigured'),
        ('configure', 'inactive'),
        ('activate', 'active'),
        ('deactivate', 'inactive'),
        ('activate', 'active'),
        ('deactivate', 'inactive'),
        ('cleanup', 'unconfigured'),
        ('configure', 'inactive'),
        ('activate', 'active'),
    ):
        assert probe.transition(node, label), (label, process.text)
        assert probe.state(node) == state
    assert probe.transition(node, 'shutdown')
    assert process.wait(60) == 0
    assert 'Traceback' not in process.text


@pytest.mark.parametrize('node', NODES)
def test_a_node_that_was_never_configured_shuts_down(node, start, probe):
    process = start(node, autostart=False)
    assert probe.state(node) == 'unconfigured'
    assert probe.transition(node, 'shutdown'), process.text
    assert process.wait(60) == 0
    assert 'Traceback' not in process.text


@pytest.mark.parametrize('node', NODES)
def test_every_parameter_is_described_and_as_the_file_says(node, start, probe, tmp_path):
    process = start(node, autostart=False)
    specs = {spec.name: spec for spec in parameter_file.NODES[node]}
    names = [n for n in probe.parameters(node) if not n.startswith('qos_overrides.')]
    assert set(specs) <= set(names)
    for name, found in zip(names, probe.describe(node, names), strict=True):
        if name == 'use_sim_time' or name.startswith('start_type_'):
            continue
        assert found.description, name
        spec = specs.get(name)
        if spec is not None and spec.unit:
            assert f'[{spec.unit}]' in found.description
        if spec is not None and isinstance(spec.default, int | float):
            assert (
                found.integer_range or found.floating_point_range or isinstance(spec.default, bool)
            )
    file = yaml.safe_load((ROOT / 'config/actuator_glue.yaml').read_text())
    values = file[f'/**/{node}']['ros__parameters']
    assert {n: values[n] for n in specs} == {n: s.default for n, s in specs.items()}
    assert process.end() == 0


def test_the_parameter_file_is_the_code_s():
    assert (ROOT / 'config/actuator_glue.yaml').read_text() == parameter_file.text()


@pytest.mark.parametrize(
    ('node', 'parameters', 'told'),
    [
        ('estimator', {'window': -1.0}, 'window'),
        ('estimator', {'hop': 9.0}, 'hop 9 s is longer than the window'),
        ('estimator', {'window': 'long'}, 'window'),
        ('estimator', {'effects': ['no-such']}, "effect 'no-such' is not in the catalogue"),
        ('actuator_sim', {'undeclared_effect': 'wobble', 'sealed_file': 'x'}, "effect 'wobble'"),
        ('actuator_sim', {'undeclared_effect': 'backlash', 'plant': 'benchmark'}, "plant 'paper'"),
        ('lab_bridge', {'file': 'no-such.csv'}, 'no-such.csv: there is no such file'),
        ('lab_bridge', {'specimen_stiffness': -0.5}, 'is negative'),
        ('replay', {'bag': 'no-such'}, 'neither a bag nor an .mcap'),
        ('recorder', {'bag': '/proc/none'}, 'cannot'),
        ('estimator', {'levels': []}, 'no band level is given'),
        ('estimator', {'tracking_frequencies': [-1.0, math.nan]}, 'must be positive and finite'),
        ('estimator', {'tracking_frequencies': [5.0, math.inf]}, 'must be positive and finite'),
        ('estimator', {'tracking_frequencies': []}, 'give at least one'),
        ('estimator', {'window': []}, 'window = [] cannot be used'),
        ('actuator_sim', {'undeclared_effect': []}, 'undeclared_effect = [] cannot be used'),
        ('margin', {'partition': 'sdof', 'compensator': []}, 'compensator []: give three numbers'),
        ('margin', {}, 'no hybrid test is given'),
        ('margin', {'partition': 'nowhere.yaml'}, 'nowhere.yaml'),
        ('margin', {'partition': 'sdof', 'clear_below': 0.5}, 'clear_below'),
    ],
)
def test_bad_parameters_end_with_2_and_one_clear_message(node, parameters, told, start):
    process = start(node, **parameters)
    assert process.wait(60) == 2
    assert told in process.text
    assert 'Traceback' not in process.text


@pytest.mark.parametrize(
    ('node', 'lists'),
    [
        ('estimator', ('effects', 'drift_of')),
        ('recorder', ('topics',)),
        ('lab_bridge', ('allow',)),
    ],
)
def test_an_empty_list_is_an_empty_list(node, lists, start, probe, tmp_path):
    """ROS hands it over without a type; nodes take it as they take their default."""
    process = start(node, **needed(node, tmp_path), **{name: [] for name in lists})
    probe.until(lambda: process.alive and probe.value(node, 'state') == 'active')
    assert process.end() == 0
    assert 'Traceback' not in process.text


def test_changes_at_run_time_are_checked_together(start, probe, tmp_path):
    process = start('actuator_sim', wait_for=99)
    probe.until(lambda: probe.value('actuator_sim', 'state') == 'active')
    (refused,) = probe.set('actuator_sim', specimen_stiffness=-1.0)
    assert not refused.successful
    (refused,) = probe.set('actuator_sim', rate=10.0)
    assert not refused.successful and 'read-only' in refused.reason
    (refused,) = probe.set('actuator_sim', hold='cubic')
    assert not refused.successful and 'zoh, linear' in refused.reason
    (taken,) = probe.set('actuator_sim', specimen_stiffness=5e4)
    assert taken.successful
    assert process.end() == 0


def test_a_transition_that_is_impossible_now_is_answered(start, probe):
    """Also by number, and after a warning: rclpy ties a severity to the line that logs."""
    process = start('actuator_sim', wait_for=99)
    probe.until(lambda: probe.value('actuator_sim', 'state') == 'active')
    for transition in (
        Transition(label='configure'),
        Transition(id=Transition.TRANSITION_CLEANUP),
        Transition(label='no-such'),
    ):
        asked = ChangeState.Request(transition=transition)
        assert not probe.call(ChangeState, 'actuator_sim/change_state', asked).success
    for asked in 'configure', 'number 2', 'no-such':
        probe.until(lambda a=asked: f'{a} is impossible: active' in process.text)
    assert probe.state('actuator_sim') == 'active'
    assert probe.transition('actuator_sim', 'deactivate')
    assert 'Traceback' not in process.text and process.end() == 0
