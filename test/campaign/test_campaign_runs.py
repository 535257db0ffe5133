"""Campaigns on dask.distributed: every row once, whatever ends on the way."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import nullcontext
from pathlib import Path
from unittest.mock import Mock

import pytest
from distributed import LocalCluster
from tiny_analysis import ANALYSIS

import actuator_glue as ag
from actuator_glue.campaigns import campaign
from actuator_glue.campaigns.progress_file import Progress, read_progress
from actuator_glue.campaigns.recipe import Recipe
from actuator_glue.campaigns.rows import RowFolder, read_results
from actuator_glue.cli.main import main

Start = Callable[..., subprocess.Popen[str]]
# What tells how and when, and no number of a record.
OF_THE_RUN = {'seconds', 'finished', 'process'}


@pytest.fixture
def start() -> Iterator[Start]:
    """Return a function that starts Python with some arguments; what still runs is ended."""
    running: list[subprocess.Popen[str]] = []

    def begin(*args: object) -> subprocess.Popen[str]:
        process = subprocess.Popen([sys.executable, *map(str, args)], text=True)
        running.append(process)
        return process

    yield begin
    for process in running:
        process.kill()
        process.wait()


@pytest.fixture
def scheduler(start: Start, tmp_path: Path) -> str:
    """Address of a scheduler in a process of its own."""
    place = tmp_path / 'scheduler.json'
    start(
        '-m',
        'distributed.cli.dask_scheduler',
        '--scheduler-file',
        place,
        '--host',
        '127.0.0.1',
        '--port',
        '0',
        '--no-dashboard',
    )
    until(lambda: place.exists() and place.read_text('utf-8').endswith('}'))
    return str(json.loads(place.read_text('utf-8'))['address'])


def until(true: Callable[[], bool], seconds: float = 60.0) -> None:
    """Wait for something to be true."""
    end = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < end, 'it does not come'
        time.sleep(0.02)


def add_worker(start: Start, scheduler: str) -> subprocess.Popen[str]:
    """Start a worker without a nanny: what ends is gone."""
    return start(
        '-m',
        'distributed.cli.dask_worker',
        scheduler,
        '--no-nanny',
        '--nthreads',
        '1',
        '--no-dashboard',
        '--host',
        '127.0.0.1',
    )


@pytest.mark.slow
def test_a_killed_worker_and_a_killed_client_cost_no_row(
    start: Start, scheduler: str, records: Path, tmp_path: Path
) -> None:
    """Scheduler, workers and client are processes of their own; at the end every row is once."""
    for path in records.rglob('*.csv'):
        path.write_text(f'sleep 0.3 {path.stem}')
    out = tmp_path / 'out'
    first = add_worker(start, scheduler)
    client = start(
        '-c',
        'import sys, actuator_glue as ag\n'
        'ag.campaign(sys.argv[1], sys.argv[2], scheduler=sys.argv[3], analysis=sys.argv[4])',
        records,
        out,
        scheduler,
        ANALYSIS,
    )
    made = RowFolder(out)
    until(lambda: len(list(made.all())) >= 2)
    client.send_signal(signal.SIGKILL)
    client.wait()
    before = dict(made.all())
    assert len(before) < 12
    add_worker(start, scheduler)

    def kill(now: Progress) -> None:
        if now.computed >= 1:
            first.send_signal(signal.SIGKILL)

    found = ag.campaign(records, out, scheduler=scheduler, analysis=ANALYSIS, progress=kill)
    first.wait(timeout=60.0)
    rows = dict(made.all())
    assert len(rows) == 12 and len(found.table) == 12
    assert sorted(found.table['group']) == sorted(
        p.relative_to(records).as_posix() for p in records.rglob('*.csv')
    )
    # What was made before the kills was not made again.
    assert all(rows[key] == row for key, row in before.items())
    assert found.progress.known >= len(before)
    assert (found.progress.state, found.progress.done, found.progress.failed) == (
        'finished',
        12,
        0,
    )


def test_a_scheduler_that_goes_leaves_a_table_and_says_how_to_go_on(
    start: Start, tmp_path: Path
) -> None:
    """How many groups have their rows, and where; the same call makes the others."""
    place, out, folder = tmp_path / 'scheduler.json', tmp_path / 'out', tmp_path / 'files'
    folder.mkdir()
    for number in range(4):
        (folder / f'{number}.csv').write_text(f'sleep {0.1 if number < 2 else 60} {number}')
    options = ('--host', '127.0.0.1', '--port', '0', '--no-dashboard')
    module = 'distributed.cli.dask_scheduler'
    process = start('-m', module, '--scheduler-file', place, *options)
    until(lambda: place.exists() and place.read_text('utf-8').endswith('}'))
    address = str(json.loads(place.read_text('utf-8'))['address'])
    add_worker(start, address)

    def end(now: Progress) -> None:
        if now.computed >= 2:
            process.kill()

    with pytest.raises(ag.InputError, match='2 of 4 groups have their rows') as told:
        ag.campaign(folder, out, scheduler=address, analysis=ANALYSIS, progress=end)
    assert f'{out / "results.parquet"} holds: run the same command again' in str(told.value)
    assert sorted(read_results(out)['group']) == ['0.csv', '1.csv']


def test_a_scheduler_that_goes_before_any_row_leaves_no_table(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An empty one would be taken for a table of no campaign."""
    (tmp_path / '0.csv').write_text('sleep 0 0')
    client = Mock(nthreads=Mock(side_effect=OSError))
    monkeypatch.setattr(campaign, 'connected', lambda *_: nullcontext(client))
    with pytest.raises(ag.InputError, match='0 of 1 groups have their rows: run the same'):
        ag.campaign(tmp_path, tmp_path / 'out', analysis=ANALYSIS)
    assert not (tmp_path / 'out' / 'results.parquet').exists()


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_a_record_that_kills_workers_costs_itself_alone(records: Path, tmp_path: Path) -> None:
    """Those beside it are not blamed, and workers that end as they start are replaced."""
    (records / 'north' / 'broken.csv').write_text('parent')
    found = ag.campaign(records, tmp_path / 'out', workers=1, analysis=ANALYSIS)
    assert len(found.table) == 13
    failed = dict(zip(found.failures['group'], found.failures['failure'], strict=True))
    assert failed == {'north/broken.csv': 'every worker that was given it ended'}


@pytest.mark.slow
def test_one_and_two_workers_make_the_same_rows(records: Path, tmp_path: Path) -> None:
    """To the bit, what the record that crashes leaves included."""
    (records / 'north' / 'broken.csv').write_text('crash')
    one = ag.campaign(records, tmp_path / 'one', workers=1, analysis=ANALYSIS)
    two = ag.campaign(records, tmp_path / 'two', workers=2, analysis=ANALYSIS)
    columns = [c for c in one.table if c not in OF_THE_RUN]
    assert one.table[columns].equals(two.table[columns])
    assert list(two.failures['group']) == ['north/broken.csv']


@pytest.mark.slow
def test_a_script_needs_no_guard(records: Path, tmp_path: Path) -> None:
    """It runs once, from its first line to its last, and says nothing that is not its own."""
    script = tmp_path / 'mine.py'
    script.write_text(
        f"""
import actuator_glue as ag
print('begins')
found = ag.campaign({str(records)!r}, {str(tmp_path / 'out')!r}, workers=2, analysis={ANALYSIS!r})
print('rows', len(found.table), set(found.table['failure']))
"""
    )
    done = subprocess.run(
        [sys.executable, script], capture_output=True, text=True, timeout=120, check=False
    )
    assert (done.returncode, done.stderr) == (0, '')
    assert done.stdout.splitlines() == ['begins', "rows 12 {''}"]


def test_schedulers_and_workers_load_no_compiler() -> None:
    """50 MB each that only the process beside a worker needs."""
    code = 'import sys, actuator_glue.campaigns.worker_task; print("llvmlite" in sys.modules)'
    told = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True, check=True)
    assert told.stdout.strip() == 'False'


@pytest.fixture(scope='module')
def here() -> Iterator[str]:
    """Address of a scheduler and two workers in this process: they start in a moment."""
    with LocalCluster(
        processes=False, n_workers=2, threads_per_worker=1, dashboard_address=None
    ) as cluster:
        yield cluster.scheduler_address


def test_only_what_changed_is_made_again(here: str, records: Path, tmp_path: Path) -> None:
    """Another content, another recipe, a failure where that is asked for; never twice."""
    broken, new = records / 'north' / 'broken.csv', records / 'south' / 'new.csv'
    broken.write_text('crash')
    told: list[Progress] = []

    def run(given: Path = records, recipe: Recipe | None = None, again: bool = False) -> Progress:
        return ag.campaign(
            given,
            tmp_path / 'out',
            recipe,
            scheduler=here,
            analysis=ANALYSIS,
            again=again,
            progress=told.append,
        ).progress

    first = run()
    assert (first.known, first.computed, first.failed) == (0, 13, 1)
    assert (told[0].done, told[-1].state) == (0, 'finished')
    assert read_progress(tmp_path / 'out') == told[-1]
    provenance = json.loads((tmp_path / 'out' / 'campaign.json').read_text('utf-8'))
    assert provenance['version'] == f'actuator_glue {ag.__version__}'
    assert (provenance['groups'], provenance['recipe']['diagnose']) == (13, 'structure')
    table = read_results(tmp_path / 'out')
    failure = table.loc[table['failure'] != '', 'failure'].item()
    assert failure == 'its process was ended by signal 11 SIGSEGV'
    broken.write_text('mended')
    new.write_text('new')
    second = run()
    assert (second.known, second.computed, second.failed) == (12, 2, 0)
    assert list(read_results(tmp_path / 'out')['failure']) == [''] * 14
    os.utime(new, (1.0, 1.0))  # the same content at another time
    third = run()
    assert (third.known, third.computed) == (14, 0)
    assert run(new, Recipe(diagnose='never')).computed == 1
    broken.write_text('refuse')
    assert run().failed == 1
    assert run(again=True).computed == 1
    assert len(read_results(tmp_path / 'out')) == 14  # one that was given by itself is there once


def test_a_campaign_is_watched_from_elsewhere(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Its last state, time left, and when nothing has been heard of it."""
    now = time.time()
    content = {'state': 'running', 'total': 100, 'known': 20, 'computed': 30, 'failed': 2}
    stale = {**content, 'started': now - 900.0, 'updated': now - 600.0, 'left_s': 7300.0}
    (tmp_path / 'progress.json').write_text(json.dumps(stale))
    assert main(['campaign', '--watch', str(tmp_path)]) == 1
    line = capsys.readouterr().out
    assert 'running: 50 of 100 groups, 2 failed, 20 known before, 2 h 01 min left' in line
    assert 'no news for 10 min: it was killed' in line
    for failed in (0, 2):  # as the campaign itself ends
        ended = {**content, 'state': 'finished', 'failed': failed}
        (tmp_path / 'progress.json').write_text(json.dumps(ended))
        assert main(['campaign', '--watch', str(tmp_path)]) == int(failed > 0)
    assert main(['campaign', '--watch', str(tmp_path / 'nowhere')]) == 2
    assert 'no campaign has run' in capsys.readouterr().err


@pytest.mark.parametrize(
    ('args', 'said'),
    [
        ([], 'give records and --out DIR'),
        (['records', '--watch', 'x'], 'give it alone'),
        (['--watch', 'x', '--json', '-'], 'give it alone'),
        (['records', '--out', 'x', '--workers', '2', '--scheduler', 'y'], 'has its own'),
        (['records', '--out', 'x', '--workers', '0'], 'workers 0 is below 1'),
        (['nowhere', '--out', 'x'], 'no such file'),
        (['records', '--out', 'records/north/north_2026-03-01_free.csv'], 'no folder'),
    ],
)
def test_what_cannot_be_run_is_told(
    args: list[str],
    said: str,
    records: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """In one line, before anything is started."""
    monkeypatch.chdir(records.parent)
    assert main(['campaign', *args]) == 2
    assert said in capsys.readouterr().err
