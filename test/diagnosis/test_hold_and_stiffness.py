"""Stiffnesses given to the wrong records, and the wrong hold, are told before all else."""

from dataclasses import replace
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

from actuator_glue.diagnosis.diagnose import diagnose
from actuator_glue.diagnosis.effort import Effort
from actuator_glue.diagnosis.pipeline import conclude
from actuator_glue.diagnosis.samples.preparation import prepare
from actuator_glue.diagnosis.scopes.hold_and_stiffness import WrongSetup, find
from actuator_glue.diagnosis.search.table import LINEAR
from actuator_glue.diagnosis.thresholds import Thresholds
from actuator_glue.model.structure import Structure
from actuator_glue.records import Hold, Record

RATE = 128.0
THETA = np.array([128.0, 5.0e10, 4.23e6, 3.3])
T = np.arange(int(12 * RATE)) / RATE
SWEEP = 2e-3 * np.sin(np.pi * (10.0 / 12.0) * T**2)


def machine(
    *stiffness: float, hold: Hold = 'zoh', effect: str = '', size: float = 6e-5, seed: int = 5
) -> list[Record]:
    """One test with each specimen, 10 um of noise."""
    rng = np.random.default_rng(seed)
    model = Structure([effect] if effect else [])
    theta = np.append(THETA, size) if effect else THETA
    records = []
    for k in stiffness:
        silent = Record(SWEEP, SWEEP, 1 / RATE, stiffness=k, hold=hold)
        noise = 1e-5 * rng.standard_normal(len(T))
        records.append(replace(silent, measured=model.simulate(theta, silent) + noise))
    return records


def given(records: list[Record], *stiffness: float) -> list[Record]:
    """The same records with the stiffnesses that a user gives."""
    return [replace(r, stiffness=k) for r, k in zip(records, stiffness, strict=True)]


@pytest.mark.parametrize('truth', [(0.0, 250e3), (0.0, 250e3, 1e6), (0.0, 0.0, 250e3)])
def test_stiffnesses_of_the_wrong_records_are_put_right(truth: tuple[float, ...]) -> None:
    """The first record's with the last one's; Eq. (2) alone is enough then."""
    wrong = [truth[-1], *truth[1:-1], truth[0]]
    other = find(prepare(given(machine(*truth), *wrong), []).fit)
    assert other is not None and other.enough
    assert (other.stiffness, other.changed) == (truth, ('stiffness',))
    assert other.error == pytest.approx(1e-5, rel=0.1)
    assert other.as_given > 1.5 * other.error


def test_both_may_be_wrong() -> None:
    """Exchanged stiffnesses of commands that run linearly."""
    records = machine(0.0, 250e3, hold='linear')
    wrong = [replace(r, hold='zoh') for r in given(records, 250e3, 0.0)]
    other = find(prepare(wrong, []).fit)
    assert other is not None and other.changed == ('stiffness', 'hold')
    assert set(other.hold) == {'linear'} and other.stiffness == (0.0, 250e3)


def test_a_held_command_that_was_given_as_linear_is_told() -> None:
    """A delay of half a sample is what it looks like otherwise."""
    wrong = [replace(r, hold='linear') for r in machine(0.0, 250e3)]
    other = find(prepare(wrong, []).fit)
    assert other is not None and (other.changed, set(other.hold)) == (('hold',), {'zoh'})


@pytest.mark.usefixtures('few_forms', 'few_names')
def test_a_command_that_ran_linearly_is_begun_with() -> None:
    """Nothing is searched for under the hold that was given: it would only imitate the lead."""
    wrong = [replace(r, hold='zoh') for r in machine(0.0, 250e3, hold='linear')]
    found = diagnose(wrong, settings=Thresholds(evaluations=0))
    assert found.verdict == 'none' and found.setup is not None and found.setup.taken
    assert {row.scope for row in found.structures} == {LINEAR}


def test_a_lead_of_about_half_a_sample_is_the_other_hold() -> None:
    """A transducer's lag too small to matter made it a lead, which has a size to fit it with."""
    records = machine(0.0, 250e3, hold='linear', effect='sensor-lag', size=3e-4)
    other = find(prepare([replace(r, hold='zoh') for r in records], []).fit)
    assert other is not None and other.runs_linearly and other.enough


@pytest.mark.slow
@pytest.mark.usefixtures('few_forms', 'few_names')
def test_the_hold_that_was_given_is_taken_again_where_it_has_more_weight() -> None:
    """Play under held commands, begun with linear ones."""
    settings, ready = Thresholds(), prepare(machine(0.0, 250e3, effect='backlash'), [])
    linear = ready.fit.with_setup(hold='linear')
    setup = WrongSetup.between(ready.fit, linear, (1e-5, 1e-5), enough=False, taken=True)
    begun, effort = ready.with_hold('linear', setup), Effort(settings.effort)
    result = conclude(begun, settings, map, lambda stage, share: None, effort)
    assert result.prepared.setup is None and result.scope == ''
    assert result.found.final.effects == ('backlash',)
    assert {row.scope for row in result.rows()} >= {'', LINEAR}


@pytest.mark.usefixtures('few_forms', 'few_names')
@pytest.mark.parametrize('hold', ['zoh', 'linear'])
def test_a_displacement_ahead_of_its_command_is_told(hold: Hold) -> None:
    """By 7.3 ms, nearly a sample; the other hold, which is a lead of half a sample, is not."""
    records = machine(0.0, 250e3, hold=hold, effect='lead', size=7.3e-3)
    other = find(prepare(records, []).fit)
    assert other is not None and other.leads and other.enough
    assert (other.lead, set(other.hold)) == (pytest.approx(7.3e-3, rel=0.02), {hold})
    assert f'with the displacement {1e3 * other.lead:.3g} ms ahead of' in other.sentence()
    assert other.options() == ('--effect', 'lead')
    found = diagnose(records, settings=Thresholds(evaluations=0))
    assert found.structure == ('lead',)
    assert found.verdict == 'missing-effect' and found.setup is None


@pytest.mark.parametrize('effect', ['', 'backlash'])
def test_a_set_up_that_is_right_stays(effect: str) -> None:
    """Of a machine that Eq. (2) describes, and of one with play."""
    for seed in range(3):
        records = machine(0.0, 250e3, effect=effect, seed=seed)
        assert find(prepare(records, []).fit) is None


def test_what_a_wrong_set_up_leaves_is_no_effect_of_the_machine() -> None:
    """Nothing is searched for; the answer is never that the model is enough."""
    found = diagnose(given(machine(0.0, 250e3), 250e3, 0.0))
    assert found.summary().startswith('check the set-ups: with specimen stiffnesses exchanged')
    assert not found.complete and not found.effects
    assert found.error.after > 1.5 * found.error.noise_floor


@pytest.mark.slow
@pytest.mark.usefixtures('few_forms', 'few_names')
def test_a_lead_is_held_against_an_effect(monkeypatch: pytest.MonkeyPatch) -> None:
    """A gain that drifts: a lead alone explains most of it, and noise hides the rest."""
    monkeypatch.syspath_prepend(str(Path(__file__).parents[2] / 'benchmarks' / 'blind'))
    case = import_module('far').build(99043, effect='gain-drift')
    rows = zip(case.commands, case.measured, case.stiffness, strict=True)
    records = [Record(u, y, 1.0 / case.rate, stiffness=k) for u, y, k in rows]
    other = find(prepare(records[:2], []).fit)
    assert other is not None and other.leads and other.enough
    found = diagnose(records[:2], records[2], settings=Thresholds(evaluations=0))
    assert found.structure == ('gain-drift',) == tuple(case.effects)
    assert found.verdict == 'missing-effect' and found.setup is None
