"""Parameters that were given at the start and that no node of the suite has."""

from __future__ import annotations

import difflib
from collections.abc import Iterator, Sequence
from typing import Any

# Of other names; a word of its own is no misspelt one.
_LIKE = 0.7


def misspelt(nodes: Sequence[Any]) -> Iterator[str]:
    """Yield a sentence on each given parameter that is unknown: ROS leaves it out without a word.

    What another node of the suite has is left alone: nodes share files and command lines.

    Args:
        nodes: those of this process, their parameters declared.
    """
    given = {name for node in nodes for name in node._parameter_overrides}
    own = {name for node in nodes for name in node._parameters}
    unknown = {n for n in given - own if not n.startswith('qos_overrides.')}
    if not unknown:
        return
    from actuator_glue.nodes.parameter_file import NODES  # all nodes: only where it is needed

    theirs = {spec.name for specs in NODES.values() for spec in specs}
    for name in sorted(unknown - theirs):
        near = difflib.get_close_matches(name, own, 1, _LIKE)
        hint = f'; did you mean {near[0]}?' if near else ''
        yield f'parameter {name} is given, and no node of the suite has it: it is left out{hint}'
