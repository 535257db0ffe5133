"""Effects added to a learned term that explains more than all effects did.

The largest effect may be one outside the catalogue. Names are then chosen for how well they
imitate it, and a true name is not found beside them: for a lag and a gain that follows the
command's rate, a payload and a drifting gain were found.
"""

from __future__ import annotations

from dataclasses import replace

from actuator_glue.diagnosis.beam_search import BeamSearch
from actuator_glue.diagnosis.trial import Trial


def with_names(selection: BeamSearch, term: Trial) -> Trial | None:
    """Add effects to a structure with a learned term while each is worth it.

    Args:
        selection: the judge; its noise stays.
        term: Eq. (2) with the description, which was added last.

    Returns:
        The structure, still marked as ending with the description; None where no name is worth it,
        or the description is not worth it with them.
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
