"""Where tasks are computed: processes of this machine, or whatever a scheduler has."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from actuator_glue.campaigns.record_process import THREADS
from actuator_glue.campaigns.rows import needed
from actuator_glue.errors import InputError

if TYPE_CHECKING:
    from distributed import Client

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
    # A record's memory and threads are held to by the process it is computed in.
    with (
        distributed.LocalCluster(
            n_workers=count,
            threads_per_worker=1,
            processes=True,
            memory_limit=0,
            host='127.0.0.1',
            dashboard_address=None,
            env=dict.fromkeys(THREADS, '1'),
            silence_logs='CRITICAL',
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        yield client
