"""Run one peer's samplers: `python -m benchmarks.peers MODULE DRAWS.npy RESULT.json`."""

from __future__ import annotations

import importlib
import json
import os
import sys
from importlib import metadata
from pathlib import Path

# One core for everybody: no threads below, one processor above.
for name in ('OMP_NUM_THREADS', 'OPENBLAS_NUM_THREADS', 'MKL_NUM_THREADS'):
    os.environ[name] = '1'
os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})

# Imports come late (E402): BLAS reads the number of its threads when it is loaded.
import numpy as np  # noqa: E402 - after the threads are set

from benchmarks.peers.common import measure  # noqa: E402 - after the threads are set

module, draws, result = sys.argv[1:4]
samplers = importlib.import_module(f'benchmarks.peers.{module}').SAMPLERS
history = np.load(draws)
version = metadata.version(module.split('_')[0])
found = {
    name: {**measure(sampler, history), 'version': version} for name, sampler in samplers.items()
}
Path(result).write_text(json.dumps(found))
