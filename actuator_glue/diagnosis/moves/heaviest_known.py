"""The heaviest structure that is known, whatever the search went on with.

A search goes on with one structure at a time, and ends where its effort does: another that was
refitted on the way may have more weight. The noise is that of the structure with the least error,
for all of them. Nothing is refitted for this but the structure told without each of its members.
"""

from __future__ import annotations

from actuator_glue.diagnosis.search.beam_search import BeamSearch
from actuator_glue.diagnosis.selection import Selection


def heaviest_known(beam: BeamSearch, found: Selection) -> Selection | None:
    """Return the selection that the heaviest known structure leads to, or None.

    Args:
        beam: the search that ended with `found`.
        found: its result.
    """
    if beam.heaviest_known(found.final) is found.final:
        return None
    beam.renoise(beam.nearest_known())
    best = beam.heaviest_known(found.final)
    if best is found.final:
        return None
    return beam.checked(best, found.singles, exchanged=False)
