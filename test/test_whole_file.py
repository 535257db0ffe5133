"""Files that are written in one step."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from actuator_glue.api import matlab, store
from actuator_glue.effects import save_effects
from actuator_glue.errors import InputError
from actuator_glue.report import html, style
from actuator_glue.whole_file import replaced, whole_file


@dataclass(frozen=True)
class Kept:
    """Something to save."""

    size: float


SAVERS: dict[str, Callable[[Path], object]] = {
    '.npz': lambda path: store.save(path, 'a/1', Kept(1.0)),
    '.mat': lambda path: matlab.write_mat(
        path, np.ones((3, 1)), {'beta_1': '1/s'}, (), effects=(), problems=()
    ),
    '.html': lambda path: html.write(path, html.Page('title', '', ())),
    '.png': lambda path: style.save(Figure(), path),
    '.yaml': lambda path: save_effects(path, ()),
}


def test_a_file_that_cannot_be_written_leaves_nothing(tmp_path: Path) -> None:
    """Neither a part of it nor another file in its place."""
    path = tmp_path / 'it.txt'
    path.write_text('before')
    for way, error in ((replaced, OSError), (whole_file, InputError)):
        with pytest.raises(error, match='no space'), way(path) as part:
            part.write_text('half')
            raise OSError('no space left')
    assert [p.read_text() for p in tmp_path.iterdir()] == ['before']


def test_two_that_write_one_file_do_not_meet(tmp_path: Path) -> None:
    """The last one to end wins."""
    path = tmp_path / 'it.npz'
    with replaced(path) as mine, replaced(path) as theirs:
        assert mine != theirs and mine.suffix == theirs.suffix == '.npz'
        mine.write_text('mine')
        theirs.write_text('theirs')
    assert path.read_text() == 'mine' and list(tmp_path.iterdir()) == [path]


def test_who_may_read_a_file_stays(tmp_path: Path) -> None:
    """One that only its owner reads is not opened to others by being written anew."""
    path = tmp_path / 'it.txt'
    path.write_text('before')
    path.chmod(0o600)
    with whole_file(path) as part:
        part.write_text('after')
    assert path.read_text() == 'after' and path.stat().st_mode & 0o777 == 0o600


def test_a_link_stays_a_link_and_a_folder_is_made(tmp_path: Path) -> None:
    """What the link leads to is written."""
    target = tmp_path / 'new' / 'it.txt'
    with whole_file(target) as part:
        part.write_text('before')
    link = tmp_path / 'link.txt'
    link.symlink_to(target)
    with whole_file(link) as part:
        part.write_text('after')
    assert link.is_symlink() and target.read_text() == 'after'


def test_what_is_no_file_is_written_as_it_is() -> None:
    """A device, and what a shell made of /dev/stdout."""
    for name in ('/dev/null', '/dev/stdout'):
        with whole_file(Path(name)) as part:
            assert part == Path(name)


@pytest.mark.parametrize('name', sorted(f'it{suffix}' for suffix in SAVERS))
def test_a_full_disk_takes_nothing_from_what_was_saved(
    tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The file of before is whole, whatever kind it is."""
    path = tmp_path / name
    path.write_text('before')

    def full(fd: int) -> None:
        raise OSError(28, 'No space left on device')

    monkeypatch.setattr('os.fsync', full)
    with pytest.raises(InputError, match=r'it.*cannot be written .No space left'):
        SAVERS[path.suffix](path)
    assert [p.read_text() for p in tmp_path.iterdir()] == ['before']
