"""Several nodes in one process, for small machines: `suite recorder estimator lab_bridge`.

Saves an interpreter, rclpy and a DDS participant per node; computing stays in processes beside it.
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Sequence

from actuator_glue.nodes import spin
from actuator_glue.nodes.base import SuiteNode

NODES = {
    'recorder': 'RecorderNode',
    'estimator': 'EstimatorNode',
    'diagnoser': 'DiagnoserNode',
    'margin': 'MarginNode',
    'viewer': 'ViewerNode',
    'actuator_sim': 'SimulatorNode',
    'lab_bridge': 'LabBridgeNode',
    'replay': 'ReplayNode',
}
USAGE = f'usage: suite NODE... [--ros-args ...]; nodes: {", ".join(NODES)}'


def main(args: Sequence[str] | None = None) -> int:
    """Run the nodes that are named; what listens starts before what streams."""
    given = list(sys.argv[1:] if args is None else args)
    names = given[: given.index('--ros-args')] if '--ros-args' in given else given
    unknown = [name for name in names if name not in NODES]
    if not names or unknown or len(set(names)) < len(names):
        what = f'{", ".join(unknown)}: no such node' if unknown else 'name each node once'
        print(f'error: {what}\n{USAGE}', file=sys.stderr)
        return 2
    makes: list[Callable[[], SuiteNode]] = []
    for name in NODES:
        if name in names:
            module = importlib.import_module(f'actuator_glue.nodes.{name}')
            makes.append(getattr(module, NODES[name]))
    return spin.together(makes, args)


if __name__ == '__main__':
    sys.exit(main())
