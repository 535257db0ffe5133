"""No output takes the place of a file unasked, and none is left half written."""

import argparse
import re
import shutil
from importlib import import_module
from pathlib import Path

import pytest

from actuator_glue.arguments import Folder, Input, Output, claim_outputs
from actuator_glue.campaigns.campaign import _write_provenance
from actuator_glue.campaigns.progress_file import Progress, ProgressFile
from actuator_glue.campaigns.recipe import Recipe
from actuator_glue.campaigns.rows import RowFolder
from actuator_glue.cli.main import commands
from actuator_glue.errors import InputError
from actuator_glue.io.load import load_records


def test_outputs_are_overwritten_only_by_force(run, tmp_path: Path, short_bag: Path) -> None:
    """What exists stays unless --force is given; a bag is a folder."""
    for name in ('a.csv', 'a.mat', 'a', 'bag_2.5'):
        out = tmp_path / name
        assert run('convert', short_bag, out).code == 0
        # A MATLAB file begins with the time of day.
        skipped = 128 if name.endswith('.mat') else 0
        before = sorted(out.glob('*')) or out.read_bytes()[skipped:]
        assert 'exists already' in run('convert', short_bag, out).message
        assert '--force' in run('convert', short_bag, out).message
        done = run('convert', '--force', short_bag, out)
        assert done.code == 0, done.err
        assert (sorted(out.glob('*')) or out.read_bytes()[skipped:]) == before
        assert len(load_records(out)[0]) == 801
    assert 'folders' in run('convert', short_bag, tmp_path / 'a.mcap').message
    (tmp_path / 'precious').mkdir()
    (tmp_path / 'precious' / 'thesis.tex').write_text('\\title')
    assert 'no bag' in run('convert', short_bag, tmp_path / 'precious', '--force').message
    assert (tmp_path / 'precious' / 'thesis.tex').exists()


def test_a_bag_that_is_not_written_leaves_the_one_before(
    run, tmp_path: Path, short_bag: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """--force replaces a bag by a whole one or not at all."""
    from actuator_glue.io import mcap_file

    assert run('convert', short_bag, tmp_path / 'bag').code == 0

    def fail(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(mcap_file.McapFile, 'finish', fail)
    assert run('convert', short_bag, tmp_path / 'bag', '--force').code == 130
    assert len(load_records(tmp_path / 'bag')[0]) == 801
    assert [p.name for p in tmp_path.iterdir()] == ['bag']


@pytest.mark.parametrize('suffix', ['.xlsx', '.txt', '.db3', '.CSVX', '.bag'])
def test_an_output_of_unknown_kind_is_refused(
    run, tmp_path: Path, short_bag: Path, suffix: str
) -> None:
    """No bag is made under the name of a spreadsheet."""
    for command in (('convert', short_bag), ('simulate',)):
        done = run(*command, tmp_path / f'free{suffix}')
        assert done.code == 2
        assert suffix in done.message and '.csv' in done.message
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    'arguments',
    [
        ('info', 'BAG', '--json', 'OUT'),
        ('recover', 'BAG', '--json', 'OUT'),
        ('replay', 'BAG', '--json', 'OUT'),
        ('calibrate', 'BAG', '--json', 'OUT'),
        ('calibrate', 'BAG', '--draws', 'OUT'),
        ('diagnose', 'BAG', '--json', 'OUT'),
        ('diagnose', 'BAG', '--report', 'OUT'),
        ('plot', 'BAG', '--out', 'FOLDER'),
        ('simulate', 'FOLDER/bag', '--effect', 'backlash'),
    ],
)
def test_every_command_refuses_what_is_there(
    run, tmp_path: Path, short_bag: Path, arguments: tuple[str, ...]
) -> None:
    """Before any work is done for it, in the same words."""
    there = [tmp_path / name for name in ('OUT', 'bag.png', 'bag.truth.json')]
    for path in there:
        path.write_text('precious')
    names = {'BAG': str(short_bag), 'OUT': str(there[0]), 'FOLDER': str(tmp_path)}
    found = [next((a.replace(k, v) for k, v in names.items() if k in a), a) for a in arguments]
    done = run(*found)
    assert done.code == 2
    assert 'exists already; choose another name, or add --force' in done.message
    assert {p.read_text() for p in there} == {'precious'}
    assert len(list(tmp_path.iterdir())) == 3


def test_nothing_lands_in_the_current_folder_unasked(
    run, tmp_path: Path, short_bag: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Commands that make files of their own have a default below out/."""
    monkeypatch.chdir(tmp_path)
    assert run('plot', short_bag).code == 0
    assert run('info', short_bag).code == 0
    assert [p.name for p in tmp_path.iterdir()] == ['out']
    assert 'out/plots' in run('plot', '--help').out


@pytest.mark.parametrize('name', ['bag', 'x.csv', 'x.mat'])
@pytest.mark.parametrize('error', [KeyboardInterrupt, OSError])
def test_half_a_conversion_is_not_left_behind(
    run, tmp_path: Path, short_bag: Path, monkeypatch: pytest.MonkeyPatch, name: str, error: type
) -> None:
    """An interrupted conversion leaves nothing that looks like a test."""
    from actuator_glue.io import export, mcap_file

    def fail(*_: object) -> None:
        raise error

    monkeypatch.setattr(mcap_file.McapFile, 'finish', fail)
    monkeypatch.setattr(export.Path, 'replace', fail)
    done = run('convert', short_bag, tmp_path / name)
    assert done.code in (2, 130)
    assert list(tmp_path.iterdir()) == []


@pytest.fixture
def tests(tmp_path: Path, short_bag: Path, run, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder to work in, with what commands read: x.csv, map.yaml, a bag, and links to them."""
    (tmp_path / 'x.csv').write_text('time_s,command_mm,measured_mm\n0,0,0\n0.01,1,1\n0.02,1,1\n')
    (tmp_path / 'map.yaml').write_text('command: {column: command_mm, unit: mm}\n')
    (tmp_path / 'link.npz').symlink_to('x.csv')
    (tmp_path / 'link').symlink_to('.')
    (tmp_path / 'hard.csv').hardlink_to(tmp_path / 'x.csv')
    shutil.copytree(short_bag, tmp_path / 'bag')
    monkeypatch.chdir(tmp_path)
    return tmp_path


def content(folder: Path) -> dict[str, bytes]:
    """Return every file of a folder by its path."""
    files = (p for p in folder.rglob('*') if p.is_file() and not p.is_symlink())
    return {str(p.relative_to(folder)): p.read_bytes() for p in files}


@pytest.mark.parametrize(
    ('line', 'read'),
    [
        ('info x.csv --json x.csv', 'it'),
        ('calibrate bag x.csv --json ./x.csv', 'it'),
        ('calibrate x.csv --save link.npz', 'x.csv'),
        ('calibrate x.csv --report link/x.csv', 'x.csv'),
        ('calibrate x.csv --json hard.csv', 'x.csv'),
        ('calibrate link.npz --json x.csv', 'link.npz'),
        ('diagnose bag --holdout x.csv --report x.csv', 'it'),
        ('info x.csv --channels map.yaml --json map.yaml', 'it'),
        ('map x.csv --out x.csv', 'it'),
        ('convert bag bag', 'it'),
        ('convert x.csv x.csv --unit m', 'it'),
        ('info bag --json bag/metadata.yaml', 'bag'),
        ('convert bag/MCAP bag', 'bag/MCAP'),
        ('simulate x.csv --command x.csv', 'it'),
    ],
)
def test_no_output_takes_the_place_of_an_input(run, tests: Path, line: str, read: str) -> None:
    """Under no name and not by --force, and before anything is computed."""
    (mcap,) = (p.name for p in (tests / 'bag').glob('*.mcap'))
    before = content(tests)
    done = run(*line.replace('MCAP', mcap).split(), '--force')
    assert done.code == 2
    read = read.replace('MCAP', mcap)
    assert f'this command reads {read}, and writing there would destroy it' in done.message
    assert content(tests) == before


def test_summaries_of_a_folder_are_written_again(run, tests: Path) -> None:
    """Those that lie in it; not what a campaign keeps there, its rows among it."""
    folder = tests / 'camp'
    rows = RowFolder(folder)
    rows.write('31ab', {'group': 'x'})
    _write_provenance(folder, Recipe(), 0, None, 'x')
    with ProgressFile(folder, Progress('running', 0), lambda _: None):
        pass
    kept = sorted(p.relative_to(tests) for p in folder.rglob('*.json'))
    assert len(kept) == 3
    before = content(tests)
    for path in kept:
        done = run('history', 'camp', '--json', path, '--force')
        assert done.code == 2
        assert f'{path}: this command reads camp, and writing there would destroy' in done.message
    assert content(tests) == before
    (folder / 'history.json').write_text('{}')
    done = run('history', 'camp', '--json', folder / 'history.json', '--force')
    assert 'no results.parquet here' in done.message


def test_numbered_outputs_spare_inputs_too(run, tests: Path) -> None:
    """Where several records make OUT_1.csv, OUT_2.csv, and one of these is read."""
    assert run('convert', 'bag', 'o_2.csv').code == 0
    before = content(tests)
    done = run('convert', 'bag', 'o_2.csv', 'o.csv', '--force')
    assert done.code == 2 and 'would destroy it' in done.message
    assert content(tests) == before


def test_inputs_are_declared_as_such() -> None:
    """Every argument that is called a file, bag or folder is an input, an output, or made."""
    for command in commands():
        parser = argparse.ArgumentParser()
        import_module(f'actuator_glue.cli.{command}').add_arguments(parser)
        for action in parser._actions:
            words = re.findall(r'[A-Z]{3,}|yaml|npz', str(action.metavar))
            if {'RECORD', 'FILE', 'BAG', 'PARTITION', 'yaml', 'npz'} & set(words):
                assert action.type in (Input, Output), (command, action.dest)


def test_two_outputs_need_two_names(run, tests: Path) -> None:
    """However these are written; a device takes what comes."""
    (tests / 'folder').mkdir()
    for one, other in (('same.x', 'same.x'), ('same.x', 'folder/../same.x'), ('y', 'link/y')):
        done = run('calibrate', 'bag', '--json', one, '--report', other)
        assert done.code == 2
        assert '--report and --json would both write' in done.message
        assert 'a name of its own' in done.message
    done = run('calibrate', 'nope.csv', '--json', '/dev/null', '--report', '/dev/null')
    assert 'nope.csv' in done.message


@pytest.mark.parametrize('command', ['calibrate', 'diagnose', 'rths'])
def test_a_report_of_another_format_is_refused_before_any_work(run, command: str) -> None:
    """It is HTML under any name, which nothing opens as PDF."""
    done = run(command, 'nope', '--report', 'out/report.pdf')
    assert done.code == 2
    assert 'out/report.pdf: a report is one HTML file, no .pdf' in done.err


@pytest.mark.parametrize(
    ('line', 'said'),
    [
        ('--save n1/x.npz --json n1', '--save n1/x.npz would lie in n1, which --json writes'),
        ('--json n1 --save link/n1/x/y.npz', '--save link/n1/x/y.npz would lie in n1, which'),
        ('--json n1/x/y.json --report n1', '--json n1/x/y.json would lie in n1, which --report'),
    ],
)
def test_no_output_is_the_folder_of_another(run, tests: Path, line: str, said: str) -> None:
    """What took hours would be lost in the end."""
    done = run('calibrate', 'bag', *line.split())
    assert done.code == 2
    assert said in done.message
    assert not (tests / 'n1').exists()


@pytest.mark.parametrize('folder_first', [True, False])
def test_a_folder_that_is_filled_is_no_file(tests: Path, folder_first: bool) -> None:
    """In whatever order they are given; files may lie in it, and two may fill one."""

    def given(**outputs: Output) -> argparse.Namespace:
        order = sorted(outputs, reverse=not folder_first)
        return argparse.Namespace(**{name: outputs[name] for name in order}, force=False)

    with pytest.raises(InputError, match=r'would both write .*new; give each a name of its own'):
        claim_outputs(given(a=Folder('new'), b=Output('link/new')))
    claim_outputs(given(a=Folder('new'), b=Output('new/x.json')))
    claim_outputs(given(a=Folder('new'), b=Folder('new')))
    claim_outputs(given(a=Folder('new'), b=Folder('new/er')))


def test_only_json_goes_to_standard_output(run, tests: Path) -> None:
    """No file is called `-` by mistake."""
    for line in ('calibrate bag --report -', 'convert x.csv -', 'map x.csv --out -'):
        done = run(*line.split())
        assert done.code == 2 and 'only --json' in done.message
    assert not (tests / '-').exists()


@pytest.mark.parametrize(
    'line',
    [
        'simulate new/er/y.csv --duration 2 --rate 100',
        'simulate new/er/y --duration 2 --rate 100 --effect backlash',
        'convert bag new/er/y.csv',
        'map x.csv --out new/er/map.yaml',
        'info bag --json new/er/x.json',
        'calibrate bag --evaluations 12000 --save new/er/p.npz --json new/er/p.json',
        'calibrate bag --evaluations 12000 --save new/er/p.mat',
    ],
)
def test_folders_of_outputs_are_made(run, tests: Path, line: str) -> None:
    """By every command and for every output."""
    done = run(*line.split())
    assert done.code in (0, 1), done.err
    assert list((tests / 'new' / 'er').iterdir())


@pytest.mark.parametrize(
    'line',
    [
        'simulate x.csv/y.csv --duration 1e9',
        'calibrate nope.csv --save x.csv/p.npz',
        'calibrate nope.csv --json x.csv/p.json',
        'calibrate nope.csv --report x.csv/deep/p.html',
        'diagnose nope.csv --save-effects x.csv/p.yaml',
        'map nope.csv --out x.csv/p.yaml',
    ],
)
def test_folders_that_cannot_be_made_are_refused_first(run, tests: Path, line: str) -> None:
    """Before the records are looked at, and no other folder is left behind."""
    before = content(tests)
    done = run(*line.split())
    assert done.code == 2
    assert 'x.csv is no folder; choose another name' in done.message
    assert content(tests) == before
