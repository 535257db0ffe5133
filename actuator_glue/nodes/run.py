"""The executables: a Ctrl-C is taken before a node's libraries are, which takes seconds."""

from __future__ import annotations

import importlib
from functools import partial

from actuator_glue.nodes import signals


def _run(node: str) -> int:
    """Run a node of the suite; return the exit code."""
    signals.end_at_once()
    module = importlib.import_module(f'actuator_glue.nodes.{node}')
    return int(module.main())


_NODES = (
    'actuator_sim', 'diagnoser', 'estimator', 'lab_bridge', 'recorder', 'replay', 'viewer',
)  # fmt: skip
actuator_sim, diagnoser, estimator, lab_bridge, recorder, replay, viewer = (
    partial(_run, node) for node in _NODES
)
