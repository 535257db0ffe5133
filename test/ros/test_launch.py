"""The launch file: names only parameters and nodes that exist; a node that fails ends all."""

import ast
import runpy
import sys
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import MagicMock

import pytest

from actuator_glue.nodes import base, parameter_file

LAUNCH = Path(__file__).resolve().parents[2] / 'launch' / 'demo.launch.py'


def calls():
    """Executable and parameter names of every node(...) call, and of the shared dict."""
    tree = ast.parse(LAUNCH.read_text())
    for call in ast.walk(tree):
        if isinstance(call, ast.Call) and getattr(call.func, 'id', '') == 'node':
            name, *rest = call.args
            inside = [n for r in rest for n in ast.walk(r)]
            keys = {k.value for n in inside if isinstance(n, ast.Dict) for k in n.keys}
            shared = any(isinstance(n, ast.Name) and n.id == 'stream' for n in inside)
            yield name.value, keys | ({'wait_for', 'exit_at_end'} if shared else set())


def test_the_launch_file_names_what_exists():
    found = list(calls())
    assert {name for name, _ in found} == set(parameter_file.NODES) - {'replay'}
    for name, keys in found:
        known = {spec.name for spec in (*base.COMMON, *parameter_file.NODES[name])}
        assert keys <= known, (name, keys - known)


def test_every_launch_argument_is_used():
    tree = ast.parse(LAUNCH.read_text())
    (arguments,) = [
        n.value for n in tree.body if isinstance(n, ast.Assign) and n.targets[0].id == 'ARGUMENTS'
    ]
    declared = {key.value for key in arguments.keys}
    used = {
        call.args[0].value
        for call in ast.walk(tree)
        if isinstance(call, ast.Call)
        and getattr(call.func, 'id', '') in ('given', 'LaunchConfiguration')
        and isinstance(call.args[0], ast.Constant)
    }
    assert declared == used


@pytest.fixture
def ended(monkeypatch):
    """What the launch file does at a node's end: called as launch calls it, which is no wheel."""
    for name in {
        'launch',
        'launch.actions',
        'launch.conditions',
        'launch.event_handlers',
        'launch.events',
        'launch.substitutions',
        'launch_ros',
        'launch_ros.actions',
        'launch_ros.parameter_descriptions',
        'launch_ros.substitutions',
    }:
        monkeypatch.setitem(sys.modules, name, MagicMock())
    for kind in 'TimerAction', 'EmitEvent':
        made = lambda kind=kind, **given: SimpleNamespace(kind=kind, **given)  # noqa: E731
        setattr(sys.modules['launch.actions'], kind, made)
    rule = runpy.run_path(str(LAUNCH))['ended']

    def call(node, code, shutting_down=False):
        action = SimpleNamespace(node_executable=node)
        event = SimpleNamespace(action=action, process_name=f'{node}-1', returncode=code)
        return rule(event, SimpleNamespace(is_shutdown=shutting_down))

    return call


def test_a_node_that_cannot_start_fails_the_launch(start, tmp_path, ended):
    """A recorder whose bag exists; launch returns 1 for an exception and ends the others."""
    bag = tmp_path / 'bag'
    bag.mkdir()
    (bag / 'precious').touch()
    recorder = start('recorder', bag=str(bag))
    code = recorder.wait(30.0)
    assert code == 2 and 'exists' in recorder.text, recorder.text
    with pytest.raises(RuntimeError, match='recorder-1 ended with exit code 2'):
        ended('recorder', code)


@pytest.mark.parametrize(('node', 'code'), [('estimator', 0), ('actuator_sim', 2)])
def test_no_end_but_that_of_a_stream_is_a_success(node, code, ended):
    with pytest.raises(RuntimeError, match=f'{node}-1 ended with exit code {code}'):
        ended(node, code)


@pytest.mark.parametrize('node', ['actuator_sim', 'lab_bridge'])
def test_the_end_of_the_stream_ends_all_later(node, ended):
    timer = ended(node, 0)
    assert timer.kind == 'TimerAction' and [a.kind for a in timer.actions] == ['EmitEvent']


def test_what_ends_in_a_shutdown_is_no_failure(ended):
    assert ended('estimator', -9, shutting_down=True) is None
