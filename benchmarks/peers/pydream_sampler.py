"""PyDREAM: DREAM(ZS) as published, the only peer that finds problem R from the prior."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import tempfile
from pathlib import Path

import numpy as np
from pydream.core import run_dream
from pydream.parameters import SampledParam
from scipy.stats import uniform

from actuator_glue.records import Array
from benchmarks.peers.common import LOWER, UPPER, LogDensity, Sampler

CHAINS = 5
# The chains are forked processes; what they are given by argument would have to be pickled.
_shared: dict[str, LogDensity] = {}


def likelihood(theta: Array) -> float:
    """Log likelihood of one theta (4,)."""
    return float(_shared['density'](theta)[0])


def run(
    density: LogDensity, start: Array | None, history: Array | None, evaluations: int, seed: int
) -> Array:
    """Five chains in five processes, as PyDREAM runs them, on the cores this process may use."""
    np.random.seed(seed)  # noqa: NPY002 - PyDREAM has no other way
    parameters = [SampledParam(uniform, loc=LOWER, scale=UPPER - LOWER)]

    _shared['density'] = density
    with tempfile.TemporaryDirectory() as folder, contextlib.ExitStack() as quiet:
        options: dict[str, object] = {}
        if history is not None and start is not None:
            np.save(Path(folder) / 'history.npy', history.ravel())
            options = {
                'history_file': str(Path(folder) / 'history.npy'),
                'start': list(start),
                'start_random': False,
            }
        nowhere = quiet.enter_context(Path(os.devnull).open('w'))
        quiet.enter_context(contextlib.redirect_stdout(nowhere))
        draws, _ = run_dream(
            parameters,
            likelihood,
            nchains=CHAINS,
            niterations=evaluations // CHAINS,
            verbose=False,
            save_history=False,
            hardboundaries=True,
            history_thin=10,
            mp_context=multiprocessing.get_context('fork'),
            **options,
        )
    return np.stack(draws, axis=1)


SAMPLERS = {'PyDREAM': Sampler(run, CHAINS, '5 chains, thinning 10, snooker 0.1', 100_000, 60_000)}
