"""Chains of a long record take fewer evaluations, and that they have not met is told."""

from typing import Any

import pytest
from test_diagnose import make

from actuator_glue.diagnosis.diagnose import diagnose
from actuator_glue.diagnosis.posterior import posterior
from actuator_glue.diagnosis.search import companions
from actuator_glue.diagnosis.search.beam_search import BeamSearch
from actuator_glue.diagnosis.telling import advice
from actuator_glue.diagnosis.thresholds import Thresholds
from actuator_glue.diagnosis.trial import Trial
from actuator_glue.inference import importance
from actuator_glue.model.structure import Structure

CUT = posterior._FEWEST  # evaluations


@pytest.mark.slow
def test_chains_that_reach_no_posterior_leave_the_normal_approximation(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Too few evaluations are no fault of the records: there is an answer all the same."""
    monkeypatch.setattr(posterior, '_SIMULATED', 1)
    monkeypatch.setattr(posterior, '_FEWEST', 500)
    monkeypatch.setattr(importance, 'sample', lambda *args: (None, args[2]))
    found = diagnose(make(['valve-deadband'], [2e-4], 31)[1:2], seed=2)
    assert [e.name for e in found.effects] == ['valve-deadband']
    assert found.sampler['method'] == 'laplace'
    size = found.effects[0].parameters['deadband']
    assert size.lower < 2e-4 < size.upper and size.identified


@pytest.mark.slow
@pytest.mark.usefixtures('few_forms', 'few_names')
def test_a_companion_whose_chains_do_not_meet_opens_nothing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """It is too small to matter: what the records fix without it stays fixed, and as it was."""
    records = make(['valve-deadband'], [2e-4], 31, 12.0)[1:2]
    without = diagnose(records, seed=2, settings=Thresholds(evaluations=0))

    def larger(beam: BeamSearch, final: Trial, least: float | None = None) -> Trial:
        return final if least else beam.refits.additions(final, ['delay'])[0]

    monkeypatch.setattr(companions, 'with_companions', larger)
    drawn = posterior.sample

    def apart(model: Structure, *args: Any, **options: Any) -> posterior.Draws:
        draws = drawn(model, *args, **options)
        apart = (1.5,) * len(model.parameters)
        return draws._replace(widening=apart) if 'delay' in model.effects else draws

    monkeypatch.setattr(posterior, 'sample', apart)
    found = diagnose(records, seed=2, settings=Thresholds(evaluations=0))
    assert [e.name for e in found.effects] == ['valve-deadband']
    before, after = (f.effects[0].parameters['deadband'] for f in (without, found))
    assert before.identified and after.identified
    assert after.upper - after.lower < 1.5 * (before.upper - before.lower)


@pytest.mark.slow
def test_chains_of_a_long_record_are_cut(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where they have met nowhere no companion is drawn beside: it would meet even less."""
    monkeypatch.setattr(posterior, '_SIMULATED', 1)
    for module in (posterior, advice):
        monkeypatch.setattr(module, 'RHAT', 0.9)
        monkeypatch.setattr(module, 'APART', 0.9)
    monkeypatch.setattr(importance, 'sample', lambda *args: (None, args[2]))

    def larger(beam: BeamSearch, final: Trial, least: float | None = None) -> Trial:
        return final if least else beam.refits.additions(final, ['delay'])[0]

    monkeypatch.setattr(companions, 'with_companions', larger)
    drawn, methods = posterior.sample, []

    def spied(*args: Any, **options: Any) -> posterior.Draws:
        draws = drawn(*args, **options)
        methods.append(draws.method)
        return draws

    monkeypatch.setattr(posterior, 'sample', spied)
    found = diagnose(make(['valve-deadband'], [2e-4], 31)[1:2], seed=2)
    assert [e.name for e in found.effects] == ['valve-deadband']
    assert found.sampler['method'] == 'dream' and found.sampler['evaluations'] <= CUT
    assert methods == ['laplace', 'dream']
    size = found.effects[0].parameters['deadband']
    assert size.lower < 2e-4 < size.upper and size.identified
    assert any('have not met' in line for line in found.advice)
