"""Lifecycle transitions: where they lead, and a message for those that are not possible."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

REACHED = {
    'configure': 'inactive',
    'activate': 'active',
    'deactivate': 'inactive',
    'clean up': 'unconfigured',
    'shut down': 'finalized',
}


def answered(
    change: Callable[[Any, Any], Any],
    possible: Callable[[], Iterable[tuple[Any, ...]]],
    refused: Callable[[str], None],
) -> Callable[[Any, Any], Any]:
    """Return the callback of a change_state service that answers and reports impossible requests.

    rclpy refuses an impossible label without a word and leaves an impossible number unanswered.

    Args:
        change: rclpy's callback.
        possible: returns each transition from the node's state, number and label first.
        refused: called with the name of an impossible transition.
    """

    def call(request: Any, response: Any) -> Any:
        number, label = request.transition.id, request.transition.label
        # As rclpy has it: the label counts where there is one.
        if any(label == has[1] if label else number == has[0] for has in possible()):
            return change(request, response)
        refused(label or f'number {number}')
        response.success = False
        return response

    return call
