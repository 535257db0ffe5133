"""Records of one name in several folders: the shortest paths that tell them apart."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import actuator_glue as ag
from actuator_glue.cli.main import main
from actuator_glue.diagnosis.scopes.hold_and_stiffness import WrongSetup
from actuator_glue.diagnosis.scopes.moments import Moment
from actuator_glue.diagnosis.scopes.one_record import OneRecord
from actuator_glue.diagnosis.scopes.onset import Appeared
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.model.structure import Structure
from actuator_glue.records import source_names


@pytest.mark.parametrize(
    ('sources', 'names'),
    [
        (['w/a/t.csv', 'w/b/t.csv'], ['a/t.csv', 'b/t.csv']),
        (['w/a/t.csv', 'w/b/u.csv'], ['t.csv', 'u.csv']),
        (['w/a/t.csv', 'w/b/t.csv', 'w/b/u.csv'], ['a/t.csv', 'b/t.csv', 'u.csv']),
        (['x/a/t.csv', 'y/a/t.csv', 'y/b/t.csv'], ['x/a/t.csv', 'y/a/t.csv', 'b/t.csv']),
        (['t.csv', 'a/t.csv'], ['t.csv', 'a/t.csv']),
        (['/t.csv', '/a/t.csv'], ['/t.csv', 'a/t.csv']),
        (['a/bag:/x/samples', 'b/bag:/x/samples'], ['a/bag:/x/samples', 'b/bag:/x/samples']),
        (
            ['w/bag/ (record 1 of 2)', 'w/bag/ (record 2 of 2)'],
            ['bag (record 1 of 2)', 'bag (record 2 of 2)'],
        ),
        (['bag', 'bag/'], ['bag', 'bag/']),
        (['w/bag', 'w//bag', 'v/bag', 'v/x'], ['w/bag', 'w//bag', 'v/bag', 'x']),
        (['day1//test', 'day2//test'], ['day1/test', 'day2/test']),
        (['day1/./test', './test'], ['day1/test', 'test']),
        (['w/bag/:/x', 'v/bag:/x'], ['w/bag:/x', 'v/bag:/x']),
        (['a/t.csv', 'a/t.csv'], ['t.csv', 't.csv']),
        (['', ''], ['', '']),
    ],
)
def test_names_are_as_short_as_they_can_be(sources: list[str], names: list[str]) -> None:
    """Folders stand only where another record has the same name."""
    found = source_names(sources)
    assert len(set(found.values())) == len(set(sources))
    assert [found[s] for s in sources] == names


def test_a_calibration_tells_them_apart(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], undrawn: None
) -> None:
    """On the terminal, in JSON and in the report; without the folders that both have."""
    files = []
    for test, k in (('monday', '0'), ('tuesday', '250e3')):
        files.append(str(tmp_path / test / 't.csv'))
        (tmp_path / test).mkdir()
        options = ['--stiffness', k, '--rate', '200', '--duration', '10', '--f1', '5']
        assert main(['simulate', files[-1], *options]) == 0
    out, page = tmp_path / 'c.json', tmp_path / 'c.html'
    capsys.readouterr()
    options = ['--evaluations', '12000', '--json', str(out), '--report', str(page)]
    main(['calibrate', *files, '--stiffness', '0', '250e3', *options])
    told = capsys.readouterr().out
    for name in ('monday/t.csv', 'tuesday/t.csv'):
        assert f'Tracking of {name}' in told
        assert f'at 5 Hz in {name}' in told
        assert f'... in {name}' in told
        assert f'{name}: 95 % bands' in page.read_text('utf-8')
    tracked = [of['source'] for of in json.loads(out.read_text('utf-8'))['tracking']]
    assert tracked == ['monday/t.csv', 'tuesday/t.csv']


def test_a_diagnosis_tells_them_apart() -> None:
    """Where it speaks of one of its records."""
    moved = np.zeros(100)
    one, other = (
        ag.Record(moved, moved, 0.01, stiffness=0.0, source=f'w/{folder}/t.csv')
        for folder in ('a', 'b')
    )
    base: Any = None  # which no name needs
    scope = OneRecord(Structure(['backlash']), 'backlash', (other,), (one, other)).scope
    assert scope == 'backlash in b/t.csv only'
    appeared = Appeared(Data.whole([one]), Moment(0, 3.0), base, (other,))
    assert appeared.scope == 'since 3.0 s of a/t.csv'
    setup = WrongSetup(
        (one.source, other.source), (5.0, 0.0), ('zoh', 'zoh'), ('stiffness',), 1e-6, 1e-5, True
    )
    assert '5 N/m for a/t.csv, 0 N/m for b/t.csv' in setup.sentence()
