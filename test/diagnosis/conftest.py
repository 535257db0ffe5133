"""What several tests of the diagnosis share."""

from collections.abc import Container

import pytest

from actuator_glue.diagnosis import pipeline
from actuator_glue.diagnosis.learned.forms import forms
from actuator_glue.diagnosis.moves import reserved_effects
from actuator_glue.model.effects import Effect, Scale


@pytest.fixture
def few_forms(monkeypatch: pytest.MonkeyPatch) -> None:
    """No learned term but the sensor's, for whole diagnoses that are about something else."""

    def sensors(scale: Scale, known: Container[str] = ()) -> tuple[Effect, ...]:
        return tuple(effect for effect in forms(scale, known) if effect.place == 'sensor')

    monkeypatch.setattr('actuator_glue.diagnosis.refits.refits.forms', sensors)


FEW = ('backlash', 'bias', 'coulomb-friction', 'delay', 'gain', 'gain-drift', 'valve-deadband')


@pytest.fixture
def few_names(monkeypatch: pytest.MonkeyPatch) -> None:
    """Seven names of the catalogue and no more, for those that are about something else."""

    def names(reserved: bool = False) -> tuple[str, ...]:
        return () if reserved else FEW

    for module in (pipeline, reserved_effects):
        monkeypatch.setattr(module, 'mean_effects', names)
