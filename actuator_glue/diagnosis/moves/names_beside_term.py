"""Effects added to a learned term that explains more than all effects did.

What the catalogue does not hold may be the largest effect there is. Names are then chosen for
what they make up of it, and a name that is true is not found beside them: a lag beside a gain that
follows the command's rate was a payload and a gain that drifts.
"""

from __future__ import annotations

from dataclasses import replace

from actuator_glue.diagnosis.beam_search import BeamSearch
from actuator_glue.diagnosis.trial import Trial


def with_names(selection: BeamSearch, term: Trial) -> Trial | None:
    """Add effects to a structure with a learned term while each is worth it.

    Args:
        selection: what judges; its noise stays.
        term: Eq. (2) with the description, which was added last.

    Returns:
        The structure, the description still what was added last; None where no name is worth it,
        or it is worth nothing beside them.
    """
    current = term
    while len(current.effects) < selection.settings.most:
        if selection.left(current) < selection.material:
            break
        step = selection.next_worth(current)
        if step is None:
            break
        current = step
    current = selection.pruned(current)
    if len(current.effects) < 2 or term.added not in current.effects:
        return None
    return replace(current, added=term.added)
