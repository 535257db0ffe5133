"""docs/json*.md hold every field of the objects that commands write, and no other one."""

import dataclasses
import json
import re
import shutil
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from json_pages import DOCS, JsonPages

import actuator_glue as ag
from actuator_glue import effects
from actuator_glue.api import compensation, doctor
from actuator_glue.api.combinations import combinations
from actuator_glue.api.replay_data import Compared
from actuator_glue.campaigns import campaign
from actuator_glue.campaigns.campaign import CampaignResult
from actuator_glue.campaigns.progress_file import Progress
from actuator_glue.diagnosis.estimate import Estimate
from actuator_glue.diagnosis.finding import Finding, Rival
from actuator_glue.diagnosis.learned.term import LearnedTerm
from actuator_glue.diagnosis.scopes.change import Change
from actuator_glue.diagnosis.scopes.hold_and_stiffness import WrongSetup
from actuator_glue.diagnosis.scopes.onset import Onset
from actuator_glue.diagnosis.selection import SearchStep
from actuator_glue.diagnosis.telling.next_experiment import Experiment
from actuator_glue.inference.at_bound import Pressed
from actuator_glue.inference.prior_use import PriorUse
from actuator_glue.io.json_file import write_json
from actuator_glue.model.effects import CATALOGUE
from actuator_glue.report import weights

ROOT = DOCS.parent
CUBIC = """\
bent-sensor:
  sensor: y = y + cubic*y**3
  parameters: {cubic: {unit: 1/m^2, bounds: [-4e4, 4e4], neutral: 0, meaning: odd part}}
  source: a laboratory's own
"""
SETUP = WrongSetup(('a.csv',), (250e3,), ('zoh',), ('hold',), 1e-5, 2e-5, True)
PRIOR = PriorUse('monday.npz', 0.01, 3600.0, 4, 0.02, 0.5, 'structure', ('beta_1',))
PRESSED = Pressed('alpha_3', 'lower', 0.0, True, 0.1, 0.05)


@pytest.fixture
def pages() -> JsonPages:
    """Return the pages, nothing of them seen."""
    return JsonPages()


@pytest.fixture
def own(tmp_path: Path) -> Iterator[Path]:
    """Return a file of an effect that is known, and no part of the package."""
    path = tmp_path / 'own.yaml'
    path.write_text(CUBIC)
    effects.load_effects(path)
    yield path
    for effect in CATALOGUE.registered():
        CATALOGUE.unregister(effect.name)


@pytest.fixture
def asked(pages: JsonPages, tmp_path: Path, run) -> Callable[..., dict[str, Any]]:
    """Return a function that runs a command and holds its object to the pages."""

    def ask(*words: object, codes: tuple[int, ...] = (0, 1)) -> dict[str, Any]:
        done = run(*words, '--json', '-')
        assert done.code in codes, done.err
        assert pages.check(done.json) == []
        return done.json

    return ask


def held(pages: JsonPages, content: dict[str, Any], folder: Path) -> None:
    """Hold a result's object, as it is written, to the pages."""
    write_json(content, str(folder / 'object.json'))
    assert pages.check(json.loads((folder / 'object.json').read_text('utf-8'))) == []


def test_every_schema_has_a_table_and_a_command() -> None:
    """Those that are written into files of their own, for programs of ours, are none."""
    inner = {'campaign', 'sealed', 'prior'}
    said = {
        name
        for path in (ROOT / 'actuator_glue').rglob('*.py')
        for name in re.findall(r"'actuator_glue\.(\w+)/1'", path.read_text('utf-8'))
    }
    known = {
        name.removeprefix('actuator_glue.').removesuffix('/1') for name in JsonPages().schemas
    }
    assert said - inner == known
    index = (DOCS / 'json.md').read_text('utf-8')
    listed = set(re.findall(r'^\| `[^|]*\| `actuator_glue\.(\w+)/1` \|', index, re.MULTILINE))
    assert listed == known - {'history'}  # which stands inside of `histories`


def test_what_is_told_of_files(
    run,
    asked,
    pages: JsonPages,
    own: Path,
    short_bag: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Files and bags, whole and cut; a bag of a live run, whose structures had weights."""
    made = tmp_path / 'made.csv'
    sizes = ('--rate', 100, '--duration', 2, '--stiffness', 250e3)
    options = ('--effects-file', own, '--effect', 'bent-sensor:cubic=8e3')
    assert run('simulate', made, *sizes, *options).code == 0
    truth = json.loads((tmp_path / 'made.csv.truth.json').read_text('utf-8'))
    assert pages.check(truth) == []
    course = weights.spells([(0.0, {'backlash': 0.6, 'Eq. (2)': 0.4})])
    monkeypatch.setattr(weights, 'of_bag', lambda _: {'/posterior': 'a course'})
    monkeypatch.setattr(weights, 'spells', lambda _: course)
    asked('info', short_bag, made)
    cut = tmp_path / 'cut'
    cut.mkdir()
    content = next(short_bag.glob('*.mcap')).read_bytes()
    (cut / 'cut_0.mcap').write_bytes(content[: len(content) * 2 // 3])
    assert asked('info', cut, codes=(2,))['files'][0]['damage']
    assert asked('recover', cut)['rewritten'] == ['cut_0.mcap']
    asked('map', made)
    asked('map', short_bag)
    t = np.arange(400) / 100
    u = np.sin(t**2)
    x = np.r_[u[:5], u[:-5]]
    table = {'t': t, 'u': u, 'x': x, 'load A [N]': 250.0 * x, 'load B [N]': -500.0 * x}
    pd.DataFrame(table).to_csv(tmp_path / 'raw.csv', index=False)
    asked('map', tmp_path / 'raw.csv')
    (tmp_path / 'one.csv').write_text('a,b\n' + '1.0,2.0\n' * 50)
    assert asked('map', tmp_path / 'one.csv')['problem']
    asked('send', made, '--to', 'udp://127.0.0.1:9', '--speed', 0)
    assert pages.unseen('info', 'map', 'recovery', 'sent', 'truth') == []


@pytest.mark.parametrize(
    ('unit', 'motion', 'factor'), [('deg', 'deg', 1e3), ('counts', 'counts', 1e6)]
)
def test_other_motions_stand_as_the_page_says(
    asked, tmp_path: Path, unit: str, motion: str, factor: float
) -> None:
    """Whoever multiplies as the page says has what the file holds."""
    u = 5.0 * np.sin(np.arange(400) / 20)
    table = {'time_s': np.arange(400) / 100, f'command_{unit}': u, f'measured_{unit}': 0.9 * u}
    pd.DataFrame(table).to_csv(tmp_path / 'made.csv', index=False)
    (record,) = asked('info', tmp_path / 'made.csv')['files'][0]['records']
    assert record['motion'] == motion
    assert factor * np.array(record['command_m']) == pytest.approx([u.min(), u.max()])


def test_what_doctor_found(
    asked, pages: JsonPages, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Children answer at once."""
    answer = '{"sent": 100, "received": 100, "median": 0.0002, "discovery": 0.1}'
    done = doctor.subprocess.CompletedProcess((), 0, answer, answer)
    monkeypatch.setattr(doctor, '_python', lambda *_, **__: done)
    asked('doctor', '--bags', tmp_path)
    assert pages.unseen('doctor') == []


def test_what_is_told_of_campaigns(
    asked, pages: JsonPages, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A machine that was changed, an effect that came, a test that tells nothing."""
    monkeypatch.syspath_prepend(ROOT / 'test' / 'campaign')
    from laboratory_table import write_table

    rows = {'group': ['a', 'b'], 'verdict': ['none', 'failed'], 'failure': ['', 'no force']}
    found = CampaignResult(
        tmp_path, Progress('finished', 2, computed=2, failed=1), pd.DataFrame(rows)
    )
    monkeypatch.setattr(campaign, 'campaign', lambda *_, **__: found)
    assert asked('campaign', tmp_path, '--out', tmp_path / 'out')['failed'] == 1
    late = [i >= 20 for i in range(40)]
    write_table(
        tmp_path / 'years',
        seed=5,
        jump=(20, (0.2, 0.0, 0.0, 0.0)),
        days=40,
        verdict=['unexplained' if i == 10 else 'none' for i in range(40)],
        effects=['backlash' if there else '' for there in late],
        backlash_mean=[4e-5 if there else None for there in late],
        backlash_lower=[3e-5 if there else None for there in late],
        backlash_upper=[5e-5 if there else None for there in late],
    )
    told = asked('history', tmp_path / 'years')['actuators'][0]
    assert told['changes'] and told['effects'][0]['units'] == {'backlash': 'm'}
    asked('compare', tmp_path / 'years', '2025-01-01:2025-02-01', '2025-04-01:2025-04-28')
    untold = dataclasses.replace(
        (history := ag.history(tmp_path / 'years', 'north')),
        series=dataclasses.replace(history.series, untold=('alpha_3',)),
    )
    held(pages, untold.to_json(), tmp_path)
    assert pages.unseen('campaign_summary', 'histories', 'history', 'comparison') == []


def test_what_is_told_of_estimates(
    asked, pages: JsonPages, own: Path, tmp_path: Path, run, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With and without a stiffness, a prior, the force; with and without a virtual test."""
    for seed, name in enumerate('ab'):
        made = ('--rate', 200, '--duration', 10, '--stiffness', 250e3, '--seed', seed)
        assert run('simulate', tmp_path / f'{name}.csv', *made).code == 0
    few, (a, b) = ('--evaluations', 12000), (tmp_path / f'{name}.csv' for name in 'ab')
    asked('calibrate', a, *few, '--save', tmp_path / 'a.npz')
    known = ('--prior', tmp_path / 'a.npz', '--use-force', '--effect', 'delay')
    asked('calibrate', b, *few, *known, '--save', tmp_path / 'b.npz')
    found = ag.calibrate(a, evaluations=12000)
    assert found.structure is not None
    rare = dataclasses.replace(
        found,
        effects=('bent-sensor',),
        structure=dataclasses.replace(found.structure, setup=SETUP),
        at_bound=(PRESSED,),
        prior=PRIOR,
    )
    held(pages, rare.to_json(), tmp_path)
    held(pages, combinations(a, evaluations=12000).to_json(), tmp_path)
    monkeypatch.setattr(compensation, 'KINDS', ('none', 'inverse'))
    test = ('--posterior', tmp_path / 'b.npz', '--draws', 8, '--limit', 0.5)
    shaken = ('--ground-motion', 'artificial', '--compensator', 'best', '--fail', 'drift=0.005')
    asked('rths', 'sdof', *test)
    asked('rths', 'benchmark_case_1', *test, *shaken)
    assert pages.unseen('calibration', 'combinations', 'rths') == []


def test_what_is_told_of_a_stream(
    pages: JsonPages, own: Path, tmp_path: Path, short_bag: Path
) -> None:
    """With forecasts that were scored and numbers of tracking."""
    found = ag.replay(short_bag, window=3.0, hop=1.0, evaluations=2000, tracking=True)
    held(pages, found.to_json(), tmp_path)
    compared = Compared(3, 9, ('window 2: posterior differs in mean',), ('window 1: lost',))
    rare = dataclasses.replace(found, effects=('bent-sensor',), compared=compared, identical=False)
    held(pages, rare.to_json(), tmp_path)
    assert pages.unseen('replay') == []


def test_what_is_told_of_a_diagnosis(
    pages: JsonPages, own: Path, tmp_path: Path, short_bag: Path
) -> None:
    """Of a machine that lacks nothing; what others have is put beside it."""
    found = ag.diagnose(short_bag, effort=0.01)
    held(pages, found.to_json(), tmp_path)
    size = Estimate(4e-5, 1e-6, 3.8e-5, 4.2e-5, 'm', 0.0, bounds=(0.0, 1e-3))
    rival = Rival('coulomb-friction', 1.0, 0.5, 1e-6, True, 0.4, ('coulomb_force', 12.0))
    effect = Finding(
        'backlash',
        ('coulomb-friction',),
        0.6,
        'sensor',
        {'backlash': size},
        3e-5,
        1e-5,
        500.0,
        agrees_across_windows=True,
        noise=1e-6,
        rivals=(rival,),
    )
    change = Change('beta_1', 0.8, 1e-5)
    term = LearnedTerm(
        'learned-x',
        'sensor',
        'y = c*y',
        'y = 2*y',
        {'c': 2.0},
        {'c': size},
        {'y': (-1e-3, 1e-3)},
        {},
    )
    rare = dataclasses.replace(
        found,
        effects=(effect, dataclasses.replace(effect, probability=float('nan'), noise=None)),
        learned=(term,),
        at_bound=(PRESSED,),
        experiments=(Experiment('a slow triangle wave', 2e-3, 250e3, 3.0),),
        onset=Onset('a.csv', 9.0, 8.0, 10.0, 0.0, ('backlash',), (), change),
        prior=PRIOR,
        setup=SETUP,
        history=(SearchStep('backlash added', ('backlash',), 5, 1e-5),),
        error=dataclasses.replace(
            found.error,
            after_without_zero=1e-5,
            after_without_hum=1e-5,
            reached=1e-5,
            reached_before=1e-5,
            zeros=(1e-5,) * len(found.error.records),
        ),
        sampling=({**found.sampling[0], 'noise_at_rest_m': 1e-6},),
        sampler={**found.sampler, 'effective_draws': 400.0, 'pareto_k': 0.3, 'rhat': 1.0},
        rhat=1.0,
    )
    held(pages, rare.to_json(), tmp_path)
    assert pages.unseen('diagnosis') == []


def test_what_is_wrong_with_an_object_is_seen(pages: JsonPages) -> None:
    """A field that no table has, one that went, null and another type where no table says so."""
    sent = {
        'schema': 'actuator_glue.sent/1',
        'to': 'udp://127.0.0.1:9',
        'samples': 2,
        'messages': 2,
        'seconds': 0.1,
        'late': 0,
        'latest': 0.0,
        'unheard': 0,
        'kept_up': True,
    }
    assert pages.check(sent) == []
    assert pages.unseen('sent') == []
    for name, value in (('late', 0.5), ('late', None), ('kept_up', 1), ('more', 1)):
        (fault,) = pages.check({**sent, name: value})
        assert f'$.{name}: ' in fault
    (fault,) = pages.check({name: value for name, value in sent.items() if name != 'late'})
    assert fault == '$.late: a table has it, the object has not'


@pytest.mark.skipif(shutil.which('jq') is None, reason='needs jq')
def test_questions_of_the_pages_are_understood_by_jq(tmp_path: Path) -> None:
    """Each in backquotes, asked of an object without fields: jq knows the words."""
    (tmp_path / 'empty.json').write_text('{}')
    asked = [
        question
        for page in DOCS.glob('json*.md')
        for question in re.findall(
            r"`?jq (?:-\w+ )*'?([^`'\n]+?)'? \w[\w.]*\.json", page.read_text('utf-8')
        )
    ]
    assert len(asked) > 14
    for question in asked:
        done = subprocess.run(
            ['jq', f'try ({question})', tmp_path / 'empty.json'], capture_output=True, text=True
        )
        assert done.returncode in (0, 4), (question, done.stderr)
