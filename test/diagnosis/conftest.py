"""What several tests of the diagnosis share."""

from collections.abc import Container

import pytest

from actuator_glue.diagnosis.learned.forms import forms
from actuator_glue.model.effects import Effect, Scale


@pytest.fixture
def few_forms(monkeypatch: pytest.MonkeyPatch) -> None:
    """No learned term but the sensor's, for whole diagnoses that are about something else."""

    def sensors(scale: Scale, known: Container[str] = ()) -> tuple[Effect, ...]:
        return tuple(effect for effect in forms(scale, known) if effect.place == 'sensor')

    monkeypatch.setattr('actuator_glue.diagnosis.refits.refits.forms', sensors)
