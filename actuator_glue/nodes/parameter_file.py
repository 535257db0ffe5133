"""The commented parameter file: `python -m actuator_glue.nodes.parameter_file > config/...`."""

from __future__ import annotations

import textwrap

import yaml

from actuator_glue.nodes import (
    actuator_sim,
    base,
    configuration,
    diagnoser_worker,
    lab_bridge,
    margin,
    recorder,
    replay,
    viewer,
)
from actuator_glue.nodes.parameters import Spec

NODES = {
    'actuator_sim': actuator_sim.SPECS,
    'estimator': configuration.SPECS,
    'recorder': recorder.SPECS,
    'replay': replay.SPECS,
    'lab_bridge': lab_bridge.SPECS,
    'diagnoser': diagnoser_worker.SPECS,
    'margin': margin.SPECS,
    'viewer': viewer.SPECS,
}
HEAD = """\
# Every parameter of every node, with its default. Copy this file and keep what you change:
#   ros2 run actuator_glue estimator --ros-args --params-file my.yaml
# Units are SI; [1] is a number without unit. "at the start": cannot be changed while running.
# Written by python -m actuator_glue.nodes.parameter_file; a test holds it to the code.
"""


def text() -> str:
    """Return the whole file."""
    parts = [HEAD]
    for node, specs in NODES.items():
        parts.append(f'\n/**/{node}:\n  ros__parameters:\n')
        parts += [_entry(spec) for spec in (*base.COMMON, *specs)]
    return ''.join(parts)


def _entry(spec: Spec) -> str:
    notes = [spec.meaning + (f' [{spec.unit}]' if spec.unit else '')]
    if spec.lower is not None and spec.upper is not None:
        notes.append(f'{spec.lower:g} to {spec.upper:g}')
    if spec.choices:
        notes.append('one of ' + ', '.join(spec.choices))
    if spec.read_only:
        notes.append('at the start')
    comment = textwrap.fill(
        '; '.join(notes), 95, initial_indent='    # ', subsequent_indent='    # '
    )
    value = yaml.safe_dump(spec.default, default_flow_style=True).removesuffix('...\n').strip()
    return f'{comment}\n    {spec.name}: {value}\n'


if __name__ == '__main__':
    print(text(), end='')
