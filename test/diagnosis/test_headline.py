"""A headline says no more than the held-out part bears out, in text, JSON and exit code."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from actuator_glue.api import diagnosis as module
from actuator_glue.cli.main import main
from actuator_glue.diagnosis.finding import Finding, Rival
from actuator_glue.diagnosis.scopes.change import Change
from actuator_glue.diagnosis.scopes.hold_and_stiffness import WrongSetup
from actuator_glue.diagnosis.scopes.onset import Onset
from actuator_glue.diagnosis.telling.advice import contradicted, zeros
from actuator_glue.diagnosis.telling.headline import headline
from actuator_glue.diagnosis.telling.result import DiagnosisData
from actuator_glue.diagnosis.verdict.alarm import Alarm
from actuator_glue.diagnosis.verdict.held_out import HeldOutError
from actuator_glue.diagnosis.verdict.rules import (
    against,
    certainty,
    misses,
    named,
    of_both_parts,
)
from actuator_glue.diagnosis.verdicts import Verdict
from actuator_glue.model.effects import CATALOGUE

NONE = np.empty((0, 4))


def finding(name: str, noise: float | None = None) -> Finding:
    """A finding of no further interest."""
    return Finding(name, (), 1.0, 'sensor', {}, 1e-5, 1e-5, 50.0, noise=noise)


def diagnosis(
    verdict: Verdict,
    before: float,
    after: float,
    *effects: Finding,
    noise: float = 10e-6,
    scatter: float = 0.05,
) -> DiagnosisData:
    """A diagnosis with held-out errors before and after [m]."""
    removed = (before**2 - after**2) / max(before**2 - noise**2, 1e-12)
    about = (removed - 0.1, removed + 0.1)
    interval = ((1.0 - scatter) * after, (1.0 + scatter) * after)
    error = HeldOutError(before, (0, 1), after, interval, noise, removed, about, before)
    alarm = Alarm(verdict != 'none', 1e-5, 5e-6, noise, 0.01)
    judged = of_both_parts(verdict, any(e.noise is None for e in effects), error, alarm.threshold)
    return module.Diagnosis(
        judged,
        effects,
        error,
        (),
        (0.9, 0.9),
        alarm,
        (),
        {},
        (),
        (),
        NONE,
        1.0,
        NONE,
        (),
        {},
        {'left': 12e-6, 'limit': 5e-6},
        1.0,
    )


@pytest.mark.parametrize(
    ('found', 'says', 'complete'),
    [
        (
            diagnosis('none', 10.2e-6, 10.2e-6),
            'the model is enough: held-out error 10.2 um, noise 10.0 um',
            True,
        ),
        (
            diagnosis('none', 198e-6, 198e-6),
            'undecided: the fitting records ask for nothing; held-out error 198.0 um, 19.8 times '
            'the noise of 10.0 um',
            False,
        ),
        (
            diagnosis('missing-effect', 80e-6, 10.1e-6, finding('backlash')),
            'missing: backlash; held-out error 80.0 -> 10.1 um, noise 10.0 um',
            True,
        ),
        (
            diagnosis('missing-effect', 80e-6, 40e-6, finding('backlash')),
            'added, but not the whole story: backlash; held-out error 80.0 -> 40.0 um, 4.0 times '
            'the noise of 10.0 um; 12.0 um of structure in the fitting records remain',
            False,
        ),
        (
            diagnosis('missing-effect', 60e-6, 18.7e-6, finding('backlash'), noise=10.9e-6),
            'added, but not the whole story: backlash; held-out error 60.0 -> 18.7 um, 1.7 times '
            'the noise of 10.9 um; 12.0 um of structure in the fitting records remain',
            False,
        ),
        (
            diagnosis('missing-effect', 60e-6, 13.0e-6, finding('backlash'), scatter=0.5),
            'missing: backlash; held-out error 60.0 -> 13.0 um, noise 10.0 um',
            True,
        ),
        (
            diagnosis('missing-effect', 60e-6, 18.7e-6, finding('backlash'), scatter=0.5),
            'added, but not the whole story: backlash; held-out error 60.0 -> 18.7 um, 1.9 times '
            'the noise of 10.0 um; 12.0 um of structure in the fitting records remain',
            False,
        ),
        (
            diagnosis('none', 240.6e-6, 240.6e-6, scatter=0.97),
            'undecided: the fitting records ask for nothing; held-out error 240.6 um, 24.1 times '
            'the noise of 10.0 um',
            False,
        ),
        (
            diagnosis('missing-effect', 300e-6, 13.0e-6, finding('backlash')),
            'missing: backlash; held-out error 300.0 -> 13.0 um, noise 10.0 um',
            True,
        ),
        (
            diagnosis('missing-effect', 300e-6, 18.7e-6, finding('backlash')),
            'added, but not the whole story: backlash; held-out error 300.0 -> 18.7 um, 1.9 times '
            'the noise of 10.0 um; 12.0 um of structure in the fitting records remain',
            False,
        ),
        (
            diagnosis('unexplained', 43.6e-6, 43.56e-6, finding('backlash'), noise=31e-6),
            'undecided: the fitting records ask for backlash, the held-out part does not; '
            'held-out error 43.6 -> 43.6 um, 1.4 times the noise of 31.0 um',
            False,
        ),
        (
            diagnosis('none', 12.5e-6, 12.5e-6),
            'undecided: the fitting records ask for nothing; held-out error 12.5 um, 1.2 times '
            'the noise of 10.0 um',
            False,
        ),
        (
            diagnosis('none', 11.0e-6, 11.0e-6),
            'the model is enough: held-out error 11.0 um, noise 10.0 um',
            True,
        ),
        (
            diagnosis('missing-effect', 10.1e-6, 10.1e-6, finding('backlash')),
            'undecided: the fitting records ask for backlash, the held-out part does not; '
            'held-out error 10.1 -> 10.1 um, noise 10.0 um',
            False,
        ),
        (
            diagnosis('missing-effect', 80e-6, 79e-6, finding('backlash')),
            'undecided: the fitting records ask for backlash, the held-out part does not; '
            'held-out error 80.0 -> 79.0 um, 7.9 times the noise of 10.0 um',
            False,
        ),
        (
            diagnosis('missing-effect', 10.1e-6, 10.1e-6, finding('timing-jitter', noise=7e-6)),
            'the model is enough: held-out error 10.1 um, noise 10.0 um (7.0 um by timing-jitter)',
            True,
        ),
        (
            diagnosis('unexplained', 80e-6, 30e-6, finding('gain')),
            'added, but not the whole story: gain; held-out error 80.0 -> 30.0 um, 3.0 times the '
            'noise of 10.0 um; 12.0 um of structure in the fitting records remain',
            False,
        ),
        (
            diagnosis('unexplained', 80e-6, 80e-6),
            'the model is not enough and no addition is supported: held-out error 80.0 um, 8.0 '
            'times the noise of 10.0 um; 12.0 um of structure in the fitting records remain',
            False,
        ),
    ],
)
def test_the_headline_follows_the_held_out_part(
    found: DiagnosisData,
    says: str,
    complete: bool,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """First line, JSON and exit code of the command say the same."""
    record, out = tmp_path / 'r.csv', tmp_path / 'd.json'
    t = np.arange(0.0, 10.0, 0.01)
    rows = np.column_stack([t, np.sin(t), 0.9 * np.sin(t - 0.1)])
    np.savetxt(record, rows, delimiter=',', header='time_s,command_mm,measured_mm', comments='')
    monkeypatch.setattr(module, 'diagnose', lambda *_, **__: found)
    code = main(['diagnose', str(record), '--stiffness', '0', '--json', str(out)])
    assert capsys.readouterr().out.splitlines()[0] == says
    content = json.loads(out.read_text())
    assert (content['summary'], content['verdict']) == (says, found.verdict)
    assert code == (0 if complete else 1)
    assert content['complete'] is complete
    assert len(content['searched']) == sum(e.searched for e in CATALOGUE.values())


def test_records_of_one_name_are_told_apart() -> None:
    """In the one line that everybody reads."""
    effect = replace(finding('backlash'), records=('w/b/t.csv',))
    found = diagnosis('missing-effect', 40e-6, 10e-6, effect)
    alone = replace(found, remaining={**found.remaining, 'records': [{'source': 'w/b/t.csv'}]})
    assert 'backlash in t.csv only' in headline(alone)
    both = [{'source': 'w/a/t.csv'}, {'source': 'w/b/t.csv'}]
    assert 'backlash in b/t.csv only' in headline(
        replace(found, remaining={**found.remaining, 'records': both})
    )
    held_out = replace(alone, error=replace(alone.error, records=(('w/a/t.csv', 2e-6, 1e-6),)))
    assert 'backlash in b/t.csv only' in headline(held_out)
    onset = Onset('w/b/t.csv', 9.0, 8.0, 10.0, 0.0, ('backlash',))
    assert 'since 9.0 s of b/t.csv' in headline(replace(held_out, onset=onset))


def test_what_the_parameters_leave_open_contradicts_nothing() -> None:
    """A record that asks for a parameter which the fitting ones do not fix."""
    error = diagnosis('none', 13e-6, 13e-6).error
    assert misses(error, 5e-6)
    assert 'may show' in contradicted(error, 5e-6)[0]
    assert misses(replace(error, reached=12.5e-6), 5e-6)
    error = replace(error, reached=11e-6)
    assert not misses(error, 5e-6)
    assert '11.0 um with parameters as likely' in contradicted(error, 5e-6)[0]
    verdict = of_both_parts('none', False, error, 5e-6)
    said = headline(replace(diagnosis('none', 13e-6, 13e-6), error=error, verdict=verdict))
    assert said == (
        'the model is enough: held-out error 11.0 um with parameters as likely as the best '
        '(13.0 um with the best: the fitting records leave them open), noise 10.0 um'
    )
    assert not contradicted(error, 12e-6)


def test_a_record_with_a_zero_of_its_own_contradicts_nothing() -> None:
    """An offset or a drift of one record is no effect of the machine; it is told with its size."""
    error = diagnosis('none', 13e-6, 13e-6).error
    records = (('a.csv', 20e-6, 13e-6), ('b.csv', 20e-6, 13e-6))
    error = replace(error, records=records, after_without_zero=12.5e-6, zeros=(10e-6, 13e-6))
    assert misses(error, 5e-6)
    (said,) = zeros(error, 5e-6, {'a.csv': 'a.csv', 'b.csv': 'b.csv'})
    assert said.startswith('a.csv: 13.0 um are left, 10.0 um without')
    error = replace(error, after_without_zero=10.5e-6)
    assert not misses(error, 5e-6)
    verdict = of_both_parts('none', False, error, 5e-6)
    said = headline(replace(diagnosis('none', 13e-6, 13e-6), error=error, verdict=verdict))
    assert said == (
        "the model is enough: held-out error 10.5 um without each record's own offset and drift "
        '(13.0 um with them), noise 10.0 um'
    )
    rows = error.to_json()['records']
    assert [row['after_without_zero'] for row in rows] == [10e-6, 13e-6]


def refused(found: DiagnosisData) -> str:
    """Why an estimator should not go on with what was found."""
    return against(found.verdict, found.effects, found.structure, found.error)


def test_only_what_the_held_out_part_bears_out_is_applied() -> None:
    """And what is a property of the machine: of all records."""
    effect = finding('backlash')
    good = replace(diagnosis('missing-effect', 40e-6, 10e-6, effect), structure=('backlash',))
    assert refused(good) == ''
    assert 'not act in all' in refused(replace(good, effects=(replace(effect, records=('a',)),)))
    doubtful = replace(good.error, removed_ci=(-0.1, 0.5))
    assert 'exclude zero' in refused(replace(good, error=doubtful))
    assert refused(replace(good, verdict='undecided'))
    assert refused(diagnosis('none', 10e-6, 10e-6))


@pytest.mark.parametrize(
    ('reached', 'without', 'verdict', 'share'),
    [
        (10.1e-6, 40e-6, 'unexplained', 0.95),
        (11.0e-6, 18e-6, 'unexplained', (18**2 - 11**2) / (18**2 - 10**2)),
        (10.1e-6, 10.5e-6, 'undecided', 0.0),
        (30e-6, 60e-6, 'undecided', 0.0),
        (10.1e-6, None, 'undecided', 0.0),
    ],
)
def test_what_likely_parameters_leave_bears_additions_out(
    reached: float, without: float | None, verdict: str, share: float
) -> None:
    """Best parameters are far off under another stiffness, with additions more so than without.

    Those that both parts allow must leave nothing with the additions, and something without; the
    names are as sure as the share that they explain then. No such answer is complete: what it
    predicts with the best parameters is far off.
    """
    asked = diagnosis('missing-effect', 80e-6, 90e-6, finding('backlash'))
    error = replace(asked.error, reached=reached, reached_before=without)
    assert of_both_parts('missing-effect', True, error, asked.alarm.threshold) == verdict
    told = replace(asked, error=error, verdict=verdict)
    sure = certainty(0.95, True, error, asked.alarm.threshold)
    assert sure == pytest.approx(share)
    assert (told.error.to_json()['reached_before'], told.complete) == (without, False)
    if verdict == 'unexplained':
        start = '' if without is None else f'{1e6 * without:.1f} -> '
        assert told.summary() == (
            'added, but not the whole story: backlash; held-out error '
            f'{start}{1e6 * reached:.1f} um with parameters as '
            'likely as the best (80.0 -> 90.0 um with the best: the fitting records leave them '
            'open), noise 10.0 um; 12.0 um of structure in the fitting records remain'
        )
        explained = replace(told, remaining={**told.remaining, 'left': 4e-8})
        assert explained.summary().startswith(
            f'added, and left open by the fitting records: backlash; held-out error {start}'
        )
        assert explained.summary().endswith('leave them open), noise 10.0 um')


@pytest.mark.parametrize(
    ('own', 'tied', 'verdict'),
    [
        (0.975, 0.0, 'missing-effect'),
        (0.3, 0.4, 'missing-effect'),
        (0.3, 0.1, 'unexplained'),
        (0.003, 0.0, 'unexplained'),
    ],
)
def test_a_name_that_is_improbable_is_never_told_as_missing(
    own: float, tied: float, verdict: str
) -> None:
    """Nor one of several that are improbable together: they stand for something else."""
    rivals = (
        Rival('backlash', 0.0, 0.0, 0.0, True, own, own),
        Rival('valve-deadband', 1.0, 1.0, 0.0, tied > 0.0, tied, tied),
    )
    effect = replace(finding('backlash'), probability=own, rivals=rivals)
    effect = replace(effect, alternatives=('valve-deadband',) if tied else ())
    judged = named('missing-effect', [effect])
    assert judged == verdict
    found = replace(diagnosis('missing-effect', 80e-6, 10.1e-6, effect), verdict=judged)
    said = found.summary()
    assert said.startswith('missing: ') == (verdict == 'missing-effect')
    if own == 0.975:
        assert said.startswith('missing: backlash; ')
    elif verdict == 'missing-effect':
        assert said.startswith('missing: one of backlash (30 %), valve-deadband (40 %); ')
    else:
        assert f'something that looks most like backlash ({100 * own:.2g} %)' in said


@pytest.mark.parametrize(
    ('change', 'where'),
    [
        (None, 'its parameters changed'),
        (
            Change('stiffness', 0.7, 1e-5),
            'its parameters changed, as if the stiffness of the specimen had become 70 % of what '
            'it was',
        ),
    ],
)
def test_a_change_is_what_the_records_ask_for(change: Change | None, where: str) -> None:
    """Where the held-out part confirms it, and where it does not."""
    onset = Onset('b.csv', 9.0, 8.0, 10.0, 0.0, (), (), change)
    told = replace(diagnosis('none', 10e-6, 10e-6), onset=onset)
    assert told.summary().startswith(f'the model is enough since 9.0 s of b.csv, where {where}: ')
    told = replace(diagnosis('none', 198e-6, 198e-6), onset=onset)
    assert told.summary().startswith(
        f'undecided: the fitting records ask for a change since 9.0 s of b.csv, where {where}, '
        'the held-out part does not; held-out error 198.0 um'
    )


def test_a_wrong_setup_comes_first() -> None:
    """What to check, and what the verdict under the set-up that was given is worth."""
    setup = WrongSetup(
        ('a/free.csv', 'a/clamped.csv'),
        (250e3, 0.0),
        ('zoh', 'zoh'),
        ('stiffness',),
        error=10.1e-6,
        as_given=240.6e-6,
        enough=True,
    )
    found = replace(diagnosis('none', 240e-6, 240e-6), setup=setup)
    assert found.summary().startswith(
        'check the set-ups: with specimen stiffnesses exchanged (250000 N/m for free.csv, 0 N/m '
        'for clamped.csv) Eq. (2) alone leaves 10.1 um instead of 240.6 um; undecided: '
    )
    assert found.to_json()['setup']['stiffness'] == [250e3, 0.0]
    taken = replace(setup, changed=('hold',), hold=('linear', 'linear'), taken=True)
    found = replace(diagnosis('none', 10.1e-6, 10.1e-6), setup=taken)
    assert found.summary().startswith(
        'not as given but with the command running linearly between its samples (--hold linear), '
        'where Eq. (2) alone leaves 10.1 um instead of 240.6 um; the model is enough: '
    )
