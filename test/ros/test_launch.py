"""The launch file: names only parameters and nodes that exist."""

import ast
from pathlib import Path

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
