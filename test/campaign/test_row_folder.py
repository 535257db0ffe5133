"""The folder of a campaign: files that several processes write, tests that would count twice."""

import json
from pathlib import Path

import pandas as pd
import pytest
from laboratory_table import write_table

from actuator_glue.campaigns.actuator_history import history
from actuator_glue.campaigns.history_page import lead
from actuator_glue.campaigns.rows import RowFolder


def row(group: str, files: str, actuator: str = 'north', hour: int = 9) -> dict[str, str]:
    """A row with what the folder looks at."""
    made = f'2026-03-01T{hour:02d}:00:00'
    return {'group': group, 'sha256': files, 'actuator': actuator, 'finished': made}


def test_two_campaigns_write_the_table_of_one_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One that gathers while another does finds its own part of a file."""
    rows = RowFolder(tmp_path)
    rows.write('aa11', row('a', 'x'))
    plain, again = pd.DataFrame.to_parquet, iter([True])

    def meanwhile(table: pd.DataFrame, path: Path, **more: bool) -> None:
        plain(table, path, **more)
        if next(again, False):
            rows.gather({'a': 'aa11'})

    monkeypatch.setattr(pd.DataFrame, 'to_parquet', meanwhile)
    assert list(rows.gather({'a': 'aa11'})['group']) == ['a']
    assert sorted(p.name for p in tmp_path.iterdir()) == ['results.parquet', 'rows']


def test_a_test_that_is_grouped_otherwise_is_in_the_table_once(tmp_path: Path) -> None:
    """Rows of files of this run under other names give way; rows of other files stay."""
    rows = RowFolder(tmp_path)
    rows.write('aa11', row('free.csv', 'x', hour=8))
    rows.write('aa12', row('clamped.csv', 'y', hour=8))
    rows.write('aa13', row('last_year.csv', 'z', hour=8))
    rows.write('aa14', row('elsewhere.csv', 'x', 'south', hour=8))  # simulated with one seed
    rows.write('aa15', row('gone.csv', '', hour=8))  # could not be read
    rows.write('bb11', row('north/2026-03-01', 'x; y'))
    table = rows.gather({'north/2026-03-01': 'bb11'})
    assert list(table['group']) == [
        'elsewhere.csv',
        'gone.csv',
        'last_year.csv',
        'north/2026-03-01',
    ]
    assert len(list(rows.all())) == 6  # all are kept


def test_a_copy_of_a_test_counts_once(tmp_path: Path) -> None:
    """A folder with a copy of a test tells as much as without, and which test was left out."""
    write_table(tmp_path / 'plain', 5, days=12)
    table = pd.read_parquet(tmp_path / 'plain' / 'results.parquet')
    table['sha256'] = [f'{i:064x}' for i in range(len(table))]
    copy = table.iloc[[3]].assign(group='backup/copy')
    failed = table.iloc[[4]].assign(group='broken', failure='no numbers', verdict='failed')
    both = pd.concat([table, copy, failed], ignore_index=True)
    alone, twice = history('.', 'north', results=table), history('.', 'north', results=both)
    assert json.dumps(alone.to_json()['next_test']) == json.dumps(twice.to_json()['next_test'])
    assert twice.series.left_out == {
        'broken': 'no numbers',
        'north/2025-01-10': 'holds a file of backup/copy again, which would count twice',
    }
    assert '14 tests on 12 days from' in lead(twice)
    assert '2 of them without numbers that count' in lead(twice)
    assert 'without numbers' not in lead(alone)
