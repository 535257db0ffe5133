"""The online estimator on one core: 10 s windows of a 1 kHz stream, renewed 20 times a second."""

from __future__ import annotations

import statistics
import time
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from actuator_glue.inference.choice import ModelChoice, choose_model
from actuator_glue.io.bag_reader import decoded
from actuator_glue.io.bag_records import write_record
from actuator_glue.io.bag_writer import BagWriter
from actuator_glue.model import commands, linear
from actuator_glue.online import job as window_job
from actuator_glue.online.estimator import Estimator
from actuator_glue.online.playback import Item, at_once, give, items, replay, stream
from actuator_glue.online.settings import EstimatorSettings
from actuator_glue.online.stream import Preview
from actuator_glue.online.structures import Proposal, Proposed
from actuator_glue.online.window_posterior import WindowFit
from actuator_glue.records import Record
from actuator_glue.sample_block import Block
from actuator_glue.setups import StreamSetup
from actuator_glue.workers.reports import Reports

THETA = np.array([134.0, 1.1e9, 2.5e5, 0.5])
RATE = 1000.0
# The first windows of a model take longer, as they may.
_BEGINS = 20
SETTINGS = EstimatorSettings(window=10.0, hop=0.05, settle=1.0, time_budget=0.045, draws=100)


def _record(seconds: float) -> Record:
    command = commands.noise(RATE, seconds, 0.2, 8.0, seed=3)
    clean = linear.simulate(THETA, command, stiffness=250e3, period=1.0 / RATE)
    noise = 1e-5 * np.random.default_rng(4).standard_normal(len(clean))
    return Record(command, clean + noise, 1.0 / RATE, 250e3, start_ns=10**18)


def live(seconds: float) -> dict[str, float]:
    """Latency from a window's last sample to its result, if samples came at their own rate.

    Samples are pushed as fast as they can be; a window that is ready while the one before is
    still computed waits for it, as it would on one core. The clock is the time computing took.
    """
    estimator = Estimator(SETTINGS, choose_model())
    free = 0.0
    latencies: list[float] = []
    rhat: list[float] = []
    ess: list[float] = []
    missed = 0
    for item in stream(_record(seconds), block=50):
        began = time.perf_counter()
        if isinstance(item, StreamSetup):
            estimator.setup(item)
            continue
        if isinstance(item, Preview):
            estimator.preview(item)
            continue
        arrived = (item.index + len(item)) / RATE
        estimator.push(item)
        free = max(free, arrived) + time.perf_counter() - began
        while (job := estimator.next_job()) is not None:
            began = time.perf_counter()
            result = window_job.run(job)
            estimator.finish(result)
            free += time.perf_counter() - began
            latencies.append(free - arrived)
            rhat.append(float(np.max(result.rhat)))
            ess.append(float(np.min(result.ess)))
            missed += result.stopped_early
    settled = np.array(latencies[20:])
    return {
        'windows': float(len(latencies)),
        'latency_p50_ms': float(np.quantile(settled, 0.5) * 1e3),
        'latency_p99_ms': float(np.quantile(settled, 0.99) * 1e3),
        'missed': float(missed + (settled > 2.0 * SETTINGS.hop).sum()),
        'updates_per_second': 1.0 / SETTINGS.hop,
        'updates_per_second_possible': float(1.0 / np.quantile(settled, 0.5)),
        'rhat_p50': float(np.median(rhat[20:])),
        'rhat_p99': float(np.quantile(rhat[20:], 0.99)),
        'ess_p50': float(np.median(ess[20:])),
    }


def deadlines(seconds: float, leading: tuple[str, ...] = (), hop: float = 0.05) -> dict[str, Any]:
    """Return how many windows of one structure are missed, and of three with the same leading.

    Both take the same stream in turns, window by window, as live: while a window is computed
    samples go on, and what is too late is dropped. What is sampled beside the likeliest structure
    has a second core. The clock is the processor's, so that whatever else the computer does counts
    for neither. A window is missed that has no posterior two hops after its last sample.

    Args:
        seconds: of the stream.
        leading: effects of the one structure.
        hop: time from one window to the next [s]; nine tenths of it are the time budget.
    """
    settings = replace(SETTINGS, hop=hop, time_budget=0.9 * hop)
    every = dict.fromkeys((leading, ('backlash',), ('coulomb-friction',), ()))
    three = (Proposed(choose_model(names), 0.5 - 0.25 * bool(i)) for i, names in enumerate(every))
    taken = {
        1: _Taken(settings, choose_model(leading)),
        3: _Taken(settings, Proposal(tuple(three))),
    }
    for item in stream(_record(seconds), block=round(hop * RATE)):
        for one in taken.values():
            one.take(item)
    windows = round((seconds - settings.window) / hop) + 1 - _BEGINS
    found: dict[str, Any] = {'windows': windows}
    for count, one in taken.items():
        latencies = np.array([latency for number, latency in one.latencies if number > _BEGINS])
        found[f'missed_{count}'] = windows - int((latencies <= 2.0 * hop).sum())
        found[f'latency_{count}_p50_ms'] = 1e3 * float(np.median(latencies))
        found[f'latency_{count}_p99_ms'] = 1e3 * float(np.quantile(latencies, 0.99))
    seconds_beside = np.array(taken[3].beside)
    found['sampled_beside'] = len(seconds_beside)
    found['beside_p50_ms'] = 1e3 * float(np.median(seconds_beside))
    return found


class _Taken:
    """A live estimator beside others, each on a core of its own; arguments as `Estimator`."""

    def __init__(self, settings: EstimatorSettings, model: ModelChoice | Proposal) -> None:
        self.estimator = Estimator(settings, model, live=True)
        self.latencies: list[tuple[int, float]] = []
        self.beside: list[float] = []
        self._free = 0.0
        self._coming: tuple[float, WindowFit] | None = None

    def take(self, item: Item) -> None:
        """Take what arrives, and compute what there is time for until then."""
        give(self.estimator, item)
        if not isinstance(item, Block):
            return
        arrived, hop = (item.index + len(item)) / RATE, self.estimator.settings.hop
        if self._free > arrived:
            return
        if self._coming is not None and self._coming[0] <= arrived:
            self.estimator.finish_rival(self._coming[1])
            self._coming = None
        self.estimator.drop(lambda window: arrived - window.end / RATE > hop)
        if (job := self.estimator.next_job()) is None:
            return
        began = time.process_time()

        def expired() -> bool:
            # What follows the sampling takes a fifth.
            return time.process_time() > began + 0.8 * job.seconds

        result = window_job.run(job, expired)
        self.estimator.finish(result)
        self._free = arrived + time.process_time() - began
        if not result.failure:
            self.latencies.append((job.window.number, self._free - job.window.end / RATE))
        if self._coming is None and (rival := self.estimator.rival_job()) is not None:
            began = time.process_time()
            fitted = window_job.renew(rival)
            self.beside.append(time.process_time() - began)
            self._coming = self._free + self.beside[-1], fitted


def replayed(seconds: float = 300.0, repeats: int = 7) -> dict[str, Any]:
    """Replay a bag with the node's default settings, reading included; return times real time.

    As the command does where the bag holds no live run to compare with.

    With a process beside that computes what windows publish, which has started, and in this
    process alone; medians over repeats that take turns, and the least and largest of the former:
    the phases of a shared machine.
    """
    beside, alone = [], []
    with TemporaryDirectory() as folder, Reports(limits=False) as reports:
        bag = Path(folder) / 'bag'
        with BagWriter(bag) as writer:
            write_record(writer, _record(seconds))
        reports.wait(60.0)
        for _ in range(repeats):
            for rates, how in ((beside, reports), (alone, at_once)):
                began = time.perf_counter()
                streamed = items(decoded(bag, ('SampleBlock', 'TestSetup')))
                for _ in replay(streamed, EstimatorSettings(), reports=how):
                    pass
                rates.append(seconds / (time.perf_counter() - began))
    return {
        'replay_times_real_time': statistics.median(beside),
        'replay_times_real_time_range': [min(beside), max(beside)],
        'replay_times_real_time_one_core': statistics.median(alone),
    }


def priors(seconds: float = 120.0) -> dict[str, Any]:
    """Return what a window costs with the sequential prior over what it costs from the box.

    Both estimators take the same stream side by side with the node's default settings; medians of
    the processor's time over windows, the first five left out.
    """
    names = ('box', 'sequential')
    estimators = {name: Estimator(EstimatorSettings(prior=name), choose_model()) for name in names}
    costs: dict[str, list[float]] = {name: [] for name in names}
    for item in stream(_record(seconds), block=100):
        for name, estimator in estimators.items():
            give(estimator, item)
            while True:
                began = time.process_time()
                job = estimator.next_job()
                if job is None:
                    break
                estimator.finish(window_job.run(job))
                costs[name].append(time.process_time() - began)
    box, carried = (statistics.median(costs[name][5:]) for name in names)
    return {
        'box_prior_window_ms': 1e3 * box,
        'sequential_prior_window_ms': 1e3 * carried,
        'sequential_over_box': carried / box,
        'prior_windows': len(costs['box']) - 5,
    }


def run(seconds: float = 60.0) -> dict[str, Any]:
    """Return the `online` figures of bench.json; `first_use_s` is the first window, compiled."""
    began = time.perf_counter()
    for _ in replay(stream(_record(SETTINGS.window)), SETTINGS):
        pass
    first_use = time.perf_counter() - began
    live(12.0)  # scoring is compiled, too
    return {
        **live(seconds),
        **priors(),
        'seconds': seconds,
        'first_use_s': first_use,
    }
