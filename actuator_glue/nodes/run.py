"""The executables: a Ctrl-C is taken before a node's libraries are, which takes seconds."""

from __future__ import annotations

import importlib
from functools import partial

from actuator_glue.nodes import signals


def _run(node: str) -> int:
    """Run a node, or several in one process; return the exit code."""
    signals.end_at_once()
    module = importlib.import_module(f'actuator_glue.nodes.{node}')
    return int(module.main())


actuator_sim, diagnoser, estimator, lab_bridge, margin, recorder, replay, suite, viewer = (
    partial(_run, node)
    for node in (
        'actuator_sim',
        'diagnoser',
        'estimator',
        'lab_bridge',
        'margin',
        'recorder',
        'replay',
        'suite',
        'viewer',
    )
)
