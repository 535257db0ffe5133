"""Ten files as people bring them: each gives the test it was made of, or says what is needed."""

from pathlib import Path

import people_files
import pytest
from people_files import PAGE, ROWS, Row


@pytest.mark.parametrize('row', ROWS, ids=[row.make.__name__ for row in ROWS])
def test_a_file_gives_its_test_or_says_what_is_needed(row: Row, tmp_path: Path) -> None:
    """Values and rate of the record, exit codes, what is told; the page says the same."""
    found = people_files.given(row, tmp_path)
    assert row.says in found.told
    if row.first:
        assert found.codes[0] in (1, 2)
        assert row.first in found.told
    if row.first and len(row.commands) == 1:
        assert found.record is None
    else:
        assert found.codes[-1] == 0
        assert found.record is not None
        assert max(people_files.off(row, found.record)) < row.within
        assert found.record.rate == (27.0 if row.make is people_files.jittered else 250.0)
    assert people_files.gives(row, found) in PAGE.read_text('utf-8')
    assert row.brought in PAGE.read_text('utf-8')
