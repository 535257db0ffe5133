"""A campaign on Slurm through dask-jobqueue, as the page on campaigns says; needs both."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from tiny_analysis import ANALYSIS

import actuator_glue as ag
from actuator_glue.campaigns.progress_file import Progress

dask_jobqueue = pytest.importorskip('dask_jobqueue', reason='needs dask-jobqueue')
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(shutil.which('sbatch') is None, reason='needs a Slurm machine'),
]


def running() -> list[str]:
    """Return the numbers of this campaign's jobs that run."""
    told = subprocess.run(
        ['squeue', '--noheader', '--states=R', '--name=campaign-test', '--format=%A'],
        capture_output=True,
        text=True,
        check=True,
    )
    return told.stdout.split()


def test_a_cancelled_job_costs_no_row(records: Path, tmp_path: Path) -> None:
    """Slurm starts the workers; one is cancelled, another takes its place, every row is once."""
    for path in records.rglob('*.csv'):
        path.write_text(f'sleep 1 {path.stem}')
    cancelled: list[str] = []

    def cancel(now: Progress) -> None:
        if now.computed >= 2 and not cancelled:
            cancelled.extend(running()[:1])
            subprocess.run(['scancel', *cancelled], check=True)

    with dask_jobqueue.SLURMCluster(
        cores=1,
        processes=1,
        memory='1GB',
        walltime='00:10:00',
        job_name='campaign-test',
        python=sys.executable,
        log_directory=str(tmp_path / 'logs'),
        job_script_prologue=[f'export PYTHONPATH={os.environ["PYTHONPATH"]}'],
    ) as cluster:
        cluster.adapt(minimum_jobs=1, maximum_jobs=2)
        found = ag.campaign(
            records,
            tmp_path / 'out',
            scheduler=cluster.scheduler_address,
            analysis=ANALYSIS,
            progress=cancel,
        )
    assert len(cancelled) == 1
    assert (found.progress.state, found.progress.done, found.progress.failed) == (
        'finished',
        12,
        0,
    )
    assert sorted(found.table['group']) == sorted(
        p.relative_to(records).as_posix() for p in records.rglob('*.csv')
    )
    jobs = set(found.table['job'])
    assert '' not in jobs and len(jobs) >= 2
