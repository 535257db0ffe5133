"""A misspelt parameter is said; ROS leaves it out, and the node runs with its default."""

import subprocess
from types import SimpleNamespace

import pytest
from ros_nodes import executable

from actuator_glue.nodes import base
from actuator_glue.nodes.misspelt import misspelt
from actuator_glue.nodes.parameter_file import NODES


def said(given, *names):
    nodes = []
    for name in names:
        own = {spec.name for spec in (*base.COMMON, *NODES[name])} | {'use_sim_time'}
        nodes.append(SimpleNamespace(_parameter_overrides=given, _parameters=own))
    return list(misspelt(nodes))


def test_a_misspelt_parameter_is_said_once_with_the_right_name():
    (text,) = said({'windoww': 5.0, 'hop': 1.0}, 'estimator', 'recorder')
    assert 'windoww is given' in text and 'did you mean window?' in text
    (text,) = said({'sample_rate': 5.0}, 'lab_bridge')
    assert 'sample_rate' in text and 'did you mean' not in text


@pytest.mark.parametrize('name', NODES)
def test_parameters_of_other_nodes_are_left_alone(name):
    """One file, or one command line, for all of them."""
    given = {spec.name: spec.default for specs in NODES.values() for spec in specs}
    given |= {'use_sim_time': True, 'qos_overrides./samples.subscription.depth': 10}
    assert said(given, name) == []


def test_a_node_says_it(start, probe, tmp_path):
    node = start('recorder', bag=str(tmp_path / 'bag'), flush_perod=0.1)
    probe.until(lambda: 'did you mean flush_period?' in node.text, what='warning')
    assert node.end() == 0


def test_a_number_without_a_point_is_told_how_to_be_written(start):
    node = start('recorder', flush_period=1)
    assert node.wait(60.0) == 2
    assert 'flush_period = 1 cannot be used: write 1.0' in node.text


@pytest.mark.parametrize(
    ('given', 'told'),
    [
        (['--flush_period', '1.0'], '--ros-args -p NAME:=VALUE'),
        (['bag:=here'], '--ros-args -p NAME:=VALUE'),
        (['--ros-args', '--params-file', 'nowhere.yaml'], 'nowhere.yaml'),
        (['--ros-args', '--param-file', 'nowhere.yaml'], '--param-file'),
        (['--ros-args', '-p', 'bag'], 'bag'),
    ],
)
def test_a_command_line_that_cannot_be_used_is_one_error(given, told):
    """A traceback of rcl, or an argument that nobody looked at."""
    found = subprocess.run(
        [executable('recorder'), *given], capture_output=True, text=True, timeout=120, check=False
    )
    assert found.returncode == 2
    assert told in found.stderr.partition('error: ')[2]
    assert 'Traceback' not in found.stderr
