"""From files to tasks: names, tables, what files say themselves, and how each is read."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import actuator_glue as ag
from actuator_glue.campaigns.grouping import Task, tasks_of
from actuator_glue.campaigns.recipe import Recipe, parse_recipe, read_recipe
from actuator_glue.io.export import write
from actuator_glue.io.yaml_file import LARGEST

NAMES = r'(?P<actuator>[a-z]+)_(?P<day>\d{4}-\d\d-\d\d)_(?P<specimen>[a-z]+)'


def recipe_of(folder: Path, **content: Any) -> Recipe:
    """Return a recipe that says this."""
    return parse_recipe(content, folder)


def test_without_a_recipe_every_file_is_a_group(records: Path) -> None:
    """Named by its path below the folder; each once, however often it is given."""
    tasks = tasks_of([records, records / 'north'], Recipe())
    assert len(tasks) == 12
    assert tasks[0].group == 'north/north_2026-03-01_clamped.csv'
    assert len({t.group for t in tasks}) == 12


def test_files_of_one_name_in_several_folders_are_groups(tmp_path: Path) -> None:
    """By the shortest paths that tell them apart; a recipe's keys group them as before."""
    for name in ('a/free.csv', 'b/free.csv', 'b/end.csv', 'c/x/free.csv', 'c/y/x/free.csv'):
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(name)
    a, b, c = (tmp_path / name for name in 'abc')

    def groups(*given: Path) -> list[str]:
        tasks = tasks_of(given, Recipe())
        assert all(len(task.members) == 1 for task in tasks)
        return [task.group for task in tasks]

    assert groups(a, b) == ['a/free.csv', 'b/free.csv', 'end.csv']
    assert groups(a / 'free.csv', b / 'free.csv') == ['a/free.csv', 'b/free.csv']
    assert groups(c / 'x', c / 'y') == ['free.csv', 'x/free.csv']
    assert groups(c / 'x', c / 'y' / 'x') == ['c/x/free.csv', 'y/x/free.csv']
    both = ['a/free.csv', 'b/free.csv', 'c/x/free.csv', 'end.csv', 'y/x/free.csv']
    assert groups(a, b, c / 'x', c / 'y' / 'x', c / 'y') == both
    keyed = recipe_of(tmp_path, names='(?P<specimen>free|end)', group=['specimen'])
    assert [(t.group, len(t.members)) for t in tasks_of([a, b], keyed)] == [
        ('end', 1),
        ('free', 2),
    ]


def test_names_group_by_actuator_and_day(records: Path) -> None:
    """What tests of a group have in common is told; what differs is not."""
    (tasks) = tasks_of([records], recipe_of(records, names=NAMES, group=['actuator', 'day']))
    assert [t.group for t in tasks] == [
        f'{a}/2026-03-0{d}' for a in ('north', 'south') for d in (1, 2, 3)
    ]
    assert [len(t.members) for t in tasks] == [2] * 6
    assert (tasks[0].actuator, tasks[0].day, tasks[0].specimen) == ('north', '2026-03-01', None)
    assert Task.from_json(tasks[0].to_json()) == tasks[0]


def test_the_last_rule_that_says_it_holds(records: Path) -> None:
    """Stiffness by pattern, a channel map for some, held-out files for the diagnosis."""
    channels = {
        'command': {'column': 1, 'unit': 'mm'},
        'measured': {'column': 2, 'unit': 'mm'},
        'rate': 1000,
    }
    recipe = recipe_of(
        records,
        files=[
            {'match': '*.csv', 'stiffness': 250e3, 'channels': channels},
            {'match': '*_free.csv', 'stiffness': 0},
        ],
        holdout='north/*-03_*',
    )
    members = {t.group: t.members[0] for t in tasks_of([records], recipe)}
    assert members['north/north_2026-03-01_clamped.csv'].stiffness == 250e3
    free = members['north/north_2026-03-01_free.csv']
    assert (free.stiffness, free.channels, free.held_out) == (0.0, channels, False)
    assert members['north/north_2026-03-03_free.csv'].held_out


def test_a_table_says_what_names_do_not(records: Path) -> None:
    """Times with a zone are told in UTC; what a table lacks is looked for elsewhere."""
    table = records.parent / 'tests.csv'
    table.write_text(
        'file,actuator,started,stiffness\n'
        'north_2026-03-01_free.csv,old,2026-03-01T00:30:00+01:00,0\n'
        'south/south_2026-03-01_free.csv,old,2026-02-28 12:00:00,\n'
    )
    recipe = recipe_of(records.parent, table='tests.csv', names=NAMES, group=['actuator', 'day'])
    tasks = {t.group: t for t in tasks_of([records], recipe)}
    both = tasks['old/2026-02-28']
    assert [m.stiffness for m in both.members] == [0.0, None]
    assert both.started == '2026-02-28T12:00:00'
    assert sum(len(t.members) for t in tasks.values()) == 12


def test_set_ups_of_files_tell_what_nothing_else_does(tmp_path: Path) -> None:
    """Actuator and specimen of the file itself; one that cannot be read stands alone."""
    test = ag.simulate(ag.Command(rate=100.0, duration=2.0), stiffness=250e3)
    for name in ('a.csv', 'b.csv'):
        write(tmp_path / name, test)
    (tmp_path / 'c.csv').write_text('no record')
    tasks = tasks_of([tmp_path], recipe_of(tmp_path, group=['actuator', 'specimen']))
    assert [(t.group, len(t.members)) for t in tasks] == [
        ('c.csv', 1),
        ('simulated/250000 N/m', 2),
    ]


def test_a_clock_that_is_no_calendar_tells_no_day(tmp_path: Path) -> None:
    """Seconds since a test began are not the first of January 1970."""
    test = ag.simulate(ag.Command(rate=100.0, duration=2.0), stiffness=250e3)
    write(tmp_path / 'a.csv', replace(test, start_ns=10**9))
    write(tmp_path / 'b.csv', replace(test, start_ns=1_700_000_000 * 10**9))
    found = {t.group: t.day for t in tasks_of([tmp_path], recipe_of(tmp_path, group=['day']))}
    assert found == {'a.csv': None, '2023-11-14': '2023-11-14'}


def test_a_name_without_a_date_costs_its_file(records: Path) -> None:
    """The others are grouped; why this one is not is told where it is read."""
    (records / 'north' / 'north_2026-13-01_free.csv').write_text('x')
    recipe = recipe_of(records, names=NAMES, group=['actuator', 'day'])
    tasks = {t.group: t for t in tasks_of([records], recipe)}
    assert len(tasks) == 7
    (alone,) = tasks['north/north_2026-13-01_free.csv'].members
    with pytest.raises(ag.InputError, match=r"'2026-13-01' is no date"):
        alone.records()


@pytest.mark.parametrize(
    ('content', 'said'),
    [
        ({'grup': ['day']}, 'did you mean group'),
        ({'group': ['month']}, "not 'month'"),
        ({'names': '('}, 'no regular expression'),
        ({'names': '(?P<machine>.*)'}, 'not machine'),
        ({'names': '.*'}, 'named groups'),
        ({'diagnose': 'perhaps'}, "diagnose is 'perhaps'"),
        ({'memory_gb': 0.01}, 'memory_gb = 0.01 is outside'),
        ({'draws': 'yes please'}, 'true or false'),
        ({'files': [{'stiffness': 1}]}, 'rule 1: match is missing'),
        ({'files': [{'match': '*', 'channels': {'rate': 5}}]}, 'rule 1: channel map'),
        ({'files': {'match': '*'}}, 'list of rules'),
        ({'calibrate': {'evaluation': 5}}, "no option 'evaluation'"),
        ({'calibrate': {'prior': 'x.npz'}}, "no option 'prior'"),
        ({'calibrate': {'effects': ['ghost']}}, 'ghost'),
        ({'partition': 'nowhere.yaml'}, 'nowhere.yaml'),
    ],
)
def test_a_recipe_that_errs_is_refused(content: dict[str, Any], said: str, tmp_path: Path) -> None:
    """Before anything is computed, with what is wrong."""
    with pytest.raises(ag.InputError, match=said):
        recipe_of(tmp_path, **content)


def test_a_recipe_is_a_yaml_file(tmp_path: Path) -> None:
    """Its paths count from its own folder."""
    (tmp_path / 'map.yaml').write_text(
        'rate: 100\ncommand: {column: 1, unit: mm}\nmeasured: {column: 2, unit: mm}\n'
    )
    (tmp_path / 'recipe.yaml').write_text(
        'files: [{match: "*.txt", channels: map.yaml}]\npartition: sdof\nseconds: 60\n'
    )
    recipe = read_recipe(tmp_path / 'recipe.yaml')
    assert recipe.seconds == 60.0
    assert recipe.files[0].channels is not None
    assert recipe.analysis()['partition_name'] == 'sdof'
    with pytest.raises(ag.InputError, match=r'nothing\.yaml'):
        read_recipe(tmp_path / 'nothing.yaml')


def test_a_campaign_reads_every_partition_that_rths_reads(tmp_path: Path) -> None:
    """Matrices of two hundred degrees of freedom are more than a page of text."""
    matrix = np.eye(200).tolist()
    (tmp_path / 'tower.yaml').write_text(
        json.dumps(
            {
                'numerical': {'mass': 1000.0, 'damping_ratio': 0.05, 'stiffness': matrix},
                'experimental': {'mass': 1.0, 'damping': 0.0, 'stiffness': 1e4},
                'rate': 1024,
            }
        )
    )
    assert (tmp_path / 'tower.yaml').stat().st_size > LARGEST
    analysis = recipe_of(tmp_path, partition='tower.yaml').analysis()
    assert analysis['partition_name'] == 'tower'
    assert analysis['partition']['numerical']['stiffness'] == matrix


@pytest.mark.parametrize(
    ('table', 'said'),
    [
        ('name\nx\n', 'with `file` among them'),
        ('file,machine\nx,y\n', "unknown column 'machine'"),
        ('file\nnorth_2026-03-01_free.csv\nnorth_2026-03-01_free.csv\n', 'line 3: .* again'),
        ('file,started\nnorth_2026-03-01_free.csv,noon\n', "line 2: 'noon' is no date"),
        ('file\nghost.csv\n', 'not among the records: ghost.csv'),
    ],
)
def test_a_table_that_errs_is_refused(records: Path, table: str, said: str) -> None:
    """With its line."""
    (records.parent / 'tests.csv').write_text(table)
    with pytest.raises(ag.InputError, match=said):
        tasks_of([records], recipe_of(records.parent, table='tests.csv'))


def test_records_that_are_not_there_are_told(tmp_path: Path) -> None:
    """No path, and a folder without any record."""
    with pytest.raises(ag.InputError, match='no such file'):
        tasks_of([tmp_path / 'nothing'], Recipe())
    with pytest.raises(ag.InputError, match='no record in this folder'):
        tasks_of([tmp_path], Recipe())


def test_links_lead_to_each_file_once(tmp_path: Path) -> None:
    """Under its shortest path, a real one before a link; back to where one was, and nowhere."""
    rec, archive = tmp_path / 'rec', tmp_path / 'archive'
    for folder in (rec / 'z' / 'deep', archive):
        folder.mkdir(parents=True)
    for file in (rec / 'x.csv', rec / 'z' / 'deep' / 'y.csv', archive / 'old.csv'):
        file.write_text('time_s,command_mm,measured_mm\n')
    (rec / 'loop').symlink_to('.')
    (rec / 'z' / 'up').symlink_to('..')
    (rec / 'a').symlink_to('z')
    (rec / 'more').symlink_to(archive)
    (rec / 'short').symlink_to('z/deep')
    (rec / 'a.csv').symlink_to('x.csv')
    (rec / 'circle.csv').symlink_to('circle.csv')
    tasks = tasks_of([rec], Recipe())
    assert [t.group for t in tasks] == ['circle.csv', 'more/old.csv', 'short/y.csv', 'x.csv']
    for task in tasks[:1]:
        with pytest.raises(ag.InputError):
            task.members[0].records()


def test_lock_files_of_spreadsheets_are_no_records(tmp_path: Path) -> None:
    """Excel keeps `~$test.xlsx` beside a file that is open."""
    for name in ('test.xlsx', '~$test.xlsx', '.hidden.csv'):
        (tmp_path / name).write_bytes(b'PK')
    assert [t.group for t in tasks_of([tmp_path], Recipe())] == ['test.xlsx']


def test_a_recipe_that_is_not_there_offers_only_what_there_is(tmp_path: Path) -> None:
    """No recipe comes with the package."""
    with pytest.raises(ag.InputError, match=r'no\.yaml: recipe cannot be read .*a YAML file$'):
        read_recipe(tmp_path / 'no.yaml')
