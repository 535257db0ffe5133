"""Effects that passed for noise in an answer that seems complete.

Structure is told from noise by its spectrum, and may be underestimated: an effect that is found to
remove a material error is an addition like any other.
"""

from __future__ import annotations

from actuator_glue.diagnosis.search import companions
from actuator_glue.diagnosis.search.beam_search import BeamSearch
from actuator_glue.diagnosis.selection import Selection


def taken_for_noise(beam: BeamSearch, found: Selection) -> Selection | None:
    """Return a selection with further effects that turn out to matter, or None.

    Args:
        beam: the search that ended with `found`.
        found: its result, which leaves nothing material.
    """
    current = found.final
    larger = companions.with_companions(beam, current, beam.material)
    if not current.effects or larger is current:
        return None
    return beam.checked(larger, found.singles)
