"""Where tasks are computed: processes of this machine, or whatever a scheduler has."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from actuator_glue.campaigns.record_process import THREADS
from actuator_glue.campaigns.rows import needed
from actuator_glue.errors import InputError

if TYPE_CHECKING:
    from distributed import Client

# Settings of dask, which watches every thread 100 times a second and keeps long logs, all for a
# dashboard that a campaign does not have. Schedulers and workers that others start take them from
# their environment.
SETTINGS = {
    'distributed.worker.profile.enabled': False,
    'distributed.admin.low-level-log-length': 100,
    'distributed.admin.system-monitor.log-length': 100,
}
_FORGET = 10.0  # s, between
_PATIENCE = 30.0  # s, for a scheduler to answer


@contextmanager
def connected(scheduler: str | None, workers: int | None) -> Iterator[Client]:
    """Yield a client of dask.distributed.

    Args:
        scheduler: address of one that runs, as `tcp://node:8786`; None for a cluster of processes
            of this machine.
        workers: processes of that; None for one for each core that this process may use.

    Raises:
        InputError: dask.distributed is not installed, or no scheduler answers.
    """
    distributed = needed('distributed', 'a campaign')
    if scheduler is not None:
        try:
            client = distributed.Client(scheduler, timeout=_PATIENCE)
        except (OSError, ValueError, RuntimeError) as error:
            raise InputError(
                f'--scheduler {scheduler}: no dask scheduler answers there ({error}); start one '
                'with `dask scheduler`, workers with `dask worker ADDRESS`'
            ) from error
        with client:
            yield client
        return
    count = workers or len(os.sched_getaffinity(0))
    with _cluster(count) as address, distributed.Client(address) as client:
        yield client


@contextmanager
def _cluster(workers: int) -> Iterator[str]:
    """Yield the address of a cluster of processes of this machine.

    A process of its own starts it: workers that this one started would run the script anew that
    asks for them. It ends with this process, however that ends, and Ctrl-C is not for it.

    Raises:
        InputError: it could not be started.
    """
    with subprocess.Popen(
        [sys.executable, '-m', __name__, str(workers)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        start_new_session=True,
    ) as process:
        assert process.stdin is not None and process.stdout is not None
        try:
            address = process.stdout.readline().decode().strip()
            if not address:
                raise InputError(
                    f'a cluster of {workers} processes could not be started on this machine'
                )
            yield address
        finally:
            process.stdin.close()  # until then it serves
            try:
                process.wait(_PATIENCE)
            except subprocess.TimeoutExpired:
                process.kill()


def _serve(workers: int) -> None:
    """Have workers on this machine until standard input ends; the address is told first."""
    from distributed import LocalCluster
    from distributed.utils import dask

    dask.config.set(SETTINGS)
    # The process in which a record is computed enforces its limits of memory and threads.
    ended = threading.Event()
    with LocalCluster(
        n_workers=workers,
        threads_per_worker=1,
        processes=True,
        memory_limit=0,
        host='127.0.0.1',
        dashboard_address=None,
        # Any port that is free: another campaign may have the usual one.
        scheduler_kwargs={'dashboard_address': '127.0.0.1:0'},
        env=dict.fromkeys(THREADS, '1'),
        silence_logs='CRITICAL',
    ) as cluster:
        # A worker that ends as it starts is not started anew by its nanny.
        cluster.adapt(minimum=workers, maximum=workers)
        sys.stdout.write(f'{cluster.scheduler_address}\n')
        sys.stdout.flush()
        threading.Thread(target=_keep_forgetting, args=[ended], daemon=True).start()
        sys.stdin.buffer.read()
        ended.set()


def _keep_forgetting(ended: threading.Event) -> None:
    while not ended.wait(_FORGET):
        forget_names()


def forget_names() -> None:
    """Have dask forget the names of tasks that have ended: it keeps 100 000, in each process."""
    from distributed.utils import key_split

    key_split.cache_clear()


if __name__ == '__main__':
    _serve(int(sys.argv[1]))
