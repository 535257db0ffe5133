"""How far names are trusted where structure remains."""

from types import SimpleNamespace
from typing import Any

import pytest

from actuator_glue.diagnosis import fitting_verdict
from actuator_glue.diagnosis.learned.forms import forms
from actuator_glue.model.effects import CATALOGUE, Effect, Scale
from actuator_glue.model.parameters import TABLE_2
from actuator_glue.model.structure import Structure

NAMED = CATALOGUE['backlash']
LEARNED = forms(Scale(2e-3, 0.1, 60.0, 1 / 256, 250e3, TABLE_2))[0]


@pytest.mark.parametrize(('entries', 'expected'), [([NAMED], 0.9), ([NAMED, LEARNED], 0.6)])
def test_names_answer_for_what_they_explain_themselves(
    entries: list[Effect], expected: float
) -> None:
    """Of 10 um^2 of structure one is left, and three are what a learned term removes."""
    final = SimpleNamespace(mean_square=11.0, structure=Structure(entries))
    base, removed = SimpleNamespace(mean_square=20.0), {LEARNED.name: 3.0**0.5}
    found: Any = SimpleNamespace(base=base, final=final, noise=0.0, removed=removed)
    surrogate: Any = SimpleNamespace(error=1.0, structure_error=1.0)
    told = fitting_verdict._certainty(found, 1.0, surrogate)
    assert told == pytest.approx(expected)
