"""Files that are written in one step."""

from pathlib import Path

import pytest

from actuator_glue.errors import InputError
from actuator_glue.io.whole_file import replaced, whole_file


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
