"""How far names are trusted where structure remains."""

from types import SimpleNamespace
from typing import Any

import pytest

from actuator_glue.diagnosis import fitting_verdict
from actuator_glue.diagnosis.learned.forms import forms
from actuator_glue.diagnosis.thresholds import Thresholds
from actuator_glue.model.effects import CATALOGUE, Effect, Scale
from actuator_glue.model.parameters import TABLE_2
from actuator_glue.model.structure import Structure

NAMED = CATALOGUE['backlash']
LEARNED = forms(Scale(2e-3, 0.1, 60.0, 1 / 256, 250e3, TABLE_2))[0]


@pytest.mark.parametrize(
    ('entries', 'expected'), [([NAMED], 0.9), ([NAMED, LEARNED], 0.9 * Thresholds().described)]
)
def test_names_beside_a_description_that_is_not_enough(
    entries: list[Effect], expected: float
) -> None:
    """The catalogue does not hold such a machine: 1 of 15 of its names was right."""
    final = SimpleNamespace(mean_square=11.0, structure=Structure(entries))
    found: Any = SimpleNamespace(base=SimpleNamespace(mean_square=20.0), final=final, noise=0.0)
    surrogate: Any = SimpleNamespace(error=1.0, structure_error=1.0)
    told = fitting_verdict._certainty(found, 1.0, surrogate, Thresholds())
    assert told == pytest.approx(expected)
