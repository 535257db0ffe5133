"""How far names are trusted where structure remains."""

from types import SimpleNamespace
from typing import Any

import pytest
from trials import entries

from actuator_glue.diagnosis.search import fitting_verdict
from actuator_glue.model.structure import Structure

NAMED, LEARNED = 'backlash', 'learned-sensor-y3'


@pytest.mark.parametrize(('names', 'expected'), [([NAMED], 0.9), ([NAMED, LEARNED], 0.6)])
def test_names_answer_for_what_they_explain_themselves(names: list[str], expected: float) -> None:
    """Of 10 um^2 of structure one is left, and three are what a learned term removes."""
    final = SimpleNamespace(mean_square=11.0, structure=Structure(entries()[n] for n in names))
    base, removed = SimpleNamespace(mean_square=20.0), {LEARNED: 3.0**0.5}
    found: Any = SimpleNamespace(base=base, final=final, noise=0.0, removed=removed)
    surrogate: Any = SimpleNamespace(error=1.0, structure_error=1.0)
    told = fitting_verdict._certainty(found, 1.0, surrogate)
    assert told == pytest.approx(expected)
