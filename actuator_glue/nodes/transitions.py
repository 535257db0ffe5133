"""Lifecycle transitions: where they lead, and an answer to those that are not possible."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy._rclpy_pybind11 import RCLError

REACHED = {
    'configure': 'inactive',
    'activate': 'active',
    'deactivate': 'inactive',
    'clean up': 'unconfigured',
    'shut down': 'finalized',
}


def answered(
    change: Callable[[Any, Any], Any], refused: Callable[[str], None]
) -> Callable[[Any, Any], Any]:
    """Return the callback of a change_state service that answers what rclpy only raises.

    Args:
        change: rclpy's callback.
        refused: told which transition is not possible in the node's state.
    """

    def call(request: Any, response: Any) -> Any:
        try:
            return change(request, response)
        except RCLError:
            refused(request.transition.label or f'number {request.transition.id}')
            response.success = False
            return response

    return call
