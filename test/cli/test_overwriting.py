"""No output takes the place of a file unasked, and none is left half written."""

from pathlib import Path

import pytest

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
