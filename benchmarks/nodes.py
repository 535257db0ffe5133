"""Real nodes over DDS, each in a process of its own; everything is read from the recorded bag.

One run renews 10 s windows of a 1 kHz stream 20 times a second with the estimator on one core, the
other carries 10 kHz in blocks and asks what that costs.
"""

from __future__ import annotations

import os
import shutil
import tempfile
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from actuator_glue.io.bag_reader import messages
from actuator_glue.io.messages import deserialize
from actuator_glue.sample_block import stamp_ns
from benchmarks.stalls import awake, watched, withheld
from examples.demonstration.domain import free_domain
from examples.demonstration.processes import Node, Nodes
from examples.demonstration.watch import BAND, HEALTH, POSTERIOR, SAMPLES, Watch

_READY_SECONDS = 120.0
_TICK = float(os.sysconf('SC_CLK_TCK'))
_DEADLINE = 0.05  # s from a window's last sample to its band, 20 times a second
# Of the estimator on its own core: before the kernel's housekeeping, after what watches the core.
_PRIORITY = 20


@dataclass(slots=True)
class Run:
    """What one run of the nodes left.

    Attributes:
        bag: the recorded bag.
        seconds: length of the stream [s].
        cpu: processor time of each node over the stream, its own process alone [s].
        real_time: whether the estimator had real-time priority.
    """

    bag: Path
    seconds: float
    cpu: dict[str, float]
    real_time: bool


@contextmanager
def chain(
    rate: float, seconds: float, block: int, estimator: Mapping[str, Any], pin: bool
) -> Iterator[Run]:
    """Run simulator, estimator and recorder until the stream has ended.

    Args:
        rate: sample rate [Hz].
        seconds: length of the stream [s].
        block: samples per message.
        estimator: the estimator's parameters.
        pin: give the estimator and its worker one core with real-time priority, where the system
            grants that, and everything else the others; what `taskset` and `chrt` do.
    """
    folder = Path(tempfile.mkdtemp(prefix='actuator_glue_bench_'))
    # Nodes of a benchmark see each other and nobody else.
    domain = {'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST', 'ROS_DOMAIN_ID': str(free_domain())}
    before = {name: os.environ.get(name) for name in domain}
    os.environ.update(domain)
    try:
        with Nodes() as nodes:
            run = _stream(nodes, folder, rate, seconds, block, estimator, pin)
        yield run
    finally:
        shutil.rmtree(folder, ignore_errors=True)
        for name, value in before.items():
            if value is None:
                os.environ.pop(name)
            else:
                os.environ[name] = value


def _stream(
    nodes: Nodes,
    folder: Path,
    rate: float,
    seconds: float,
    block: int,
    estimator: Mapping[str, Any],
    pin: bool,
) -> Run:
    bag = folder / 'bag'
    processes: dict[str, Node] = {}

    def start(name: str, parameters: Mapping[str, Any]) -> None:
        node = processes[name] = nodes.start(name, parameters, folder)
        if pin:
            _place(node)

    start('recorder', {'bag': str(bag)})
    start('estimator', estimator)
    watch, end = Watch(bag), time.monotonic() + _READY_SECONDS
    while not watch.ready and time.monotonic() < end:
        time.sleep(0.2)
        nodes.check()
        watch.update()
    start(
        'actuator_sim',
        {
            'rate': rate,
            'block': block,
            'duration': seconds,
            'rest': 0.0,
            'command': 'noise',
            'frequency_start': 0.2,
            'frequency_end': 8.0,
            'preview': 1.0,
            'wait_for': 2,
            'exit_at_end': True,
        },
    )
    time.sleep(3.0)  # its start is no part of a stream
    began = {name: _cpu(node) for name, node in processes.items()}
    last = began
    policy = os.sched_getscheduler(processes['estimator'].process.pid)
    end = time.monotonic() + seconds + _READY_SECONDS
    while processes['actuator_sim'].running and time.monotonic() < end:
        time.sleep(0.5)
        last = {name: _cpu(node) or last[name] for name, node in processes.items()}
    time.sleep(2.0)
    nodes.check()
    cpu = {name: last[name] - began[name] for name in processes}
    return Run(bag, seconds, cpu, policy == os.SCHED_FIFO)


def _place(node: Node) -> None:
    """Give a node its cores and its priority, before its threads and its worker inherit them."""
    ours = node.name == 'estimator'
    os.sched_setaffinity(node.process.pid, _cores(ours))
    if ours:
        with suppress(PermissionError):
            os.sched_setscheduler(node.process.pid, os.SCHED_FIFO, os.sched_param(_PRIORITY))


def _cores(ours: bool) -> set[int]:
    """Return the estimator's core, the last one, or those of all others, as far as there are."""
    found = os.sched_getaffinity(0)
    last = {max(found)}
    return last if ours else found - last or last


def _cpu(node: Node) -> float:
    """Processor time of a node's own process so far [s]; 0 where it has ended."""
    try:
        fields = Path(f'/proc/{node.process.pid}/stat').read_text().rpartition(')')[2].split()
    except OSError:
        return 0.0
    return (int(fields[11]) + int(fields[12])) / _TICK


def _messages(run: Run) -> Iterator[tuple[str, int, Any]]:
    """Yield type, time of recording [ns] and content of the messages that matter."""
    for found in messages(run.bag, types=(SAMPLES, POSTERIOR, BAND, HEALTH)):
        yield found.type, found.log_time, deserialize(found.type, found.data)


def twenty_times_a_second(seconds: float) -> dict[str, float]:
    """Latency from a window's last sample to its forecast band, both as the recorder got them.

    Beside it what the machine withheld from the estimator's core: no estimator can be better than
    that. `late` are windows whose band took longer than the deadline, `late_without_stalls` those
    that would have without what was withheld, too.
    """
    settings = {'window': 10.0, 'hop': 0.05, 'settle': 1.0, 'draws': 100}
    settings['time_budget'] = _DEADLINE
    with (
        awake() as kept_awake,
        watched(*_cores(True)) as stalls,
        chain(1000.0, seconds, 10, settings, pin=True) as run,
    ):
        arrived: dict[int, int] = {}
        due: dict[int, int] = {}
        spans: list[tuple[int, int]] = []
        said: dict[str, str] = {}
        for kind, stamp, message in _messages(run):
            if kind == SAMPLES:
                end = stamp_ns(message.header) + round(
                    (len(message.command) - 1) * message.period * 1e9
                )
                arrived[end // 1_000_000] = stamp
            elif kind == POSTERIOR:
                due[int(message.window)] = arrived.get(stamp_ns(message.header) // 1_000_000, 0)
            elif kind == BAND and not message.scored and message.kind == 'total':
                if due.get(int(message.window)):
                    spans.append((due[int(message.window)], stamp))
            elif kind == HEALTH:
                said |= _said(message, 'estimator')
    settled = spans[40:]
    if not settled:
        why = said.get('window (last)') or said.get('deadline (last)') or 'no samples came'
        raise RuntimeError(f'{len(spans)} bands in {seconds:g} s, 41 are needed: {why}')
    after = np.array([stamp - due for due, stamp in settled]) * 1e-6
    excused = withheld(settled, stalls) * 1e-6
    # Compiling, before the stream, is held up by the kernel's limit on real-time priority.
    stalled = [s.woken - s.due for s in stalls if s.due > settled[0][0]]
    return {
        'seconds': seconds,
        'windows': float(len(spans)),
        'real_time_priority': float(run.real_time),
        'processors_kept_awake': float(kept_awake),
        'latency_p50_ms': float(np.quantile(after, 0.5)),
        'latency_p99_ms': float(np.quantile(after, 0.99)),
        'latency_max_ms': float(after.max()),
        'missed': float(said.get('deadlines missed', 'nan')),
        'late': float((after > 1e3 * _DEADLINE).sum()),
        'late_without_stalls': float((after - excused > 1e3 * _DEADLINE).sum()),
        'withheld_share': 1e-9 * sum(stalled) / seconds,
        'withheld_max_ms': 1e-6 * max(stalled, default=0),
        'updates_per_second': float((len(spans) - 1) / (seconds - 10.0)),
    }


def _said(message: Any, node: str) -> dict[str, str]:
    return {
        v.key: v.value for s in message.status if s.name.endswith('/' + node) for v in s.values
    }


def ten_kilohertz(seconds: float) -> dict[str, float]:
    """What carrying 10 kHz costs in blocks of 25 ms, and what is lost: nothing should be.

    The cost is the processor time of all three nodes without the estimator's worker: publishing
    (and simulating), cutting windows, writing the bag.
    """
    settings = {'window': 5.0, 'hop': 1.0}
    with chain(10_000.0, seconds, 250, settings, pin=False) as run:
        indices = [
            np.arange(m.index, m.index + len(m.command))
            for kind, _, m in _messages(run)
            if kind == SAMPLES
        ]
        found = np.concatenate(indices)
        wanted = round(seconds * 10_000.0)
        share = {name: cpu / (seconds - 3.0) for name, cpu in run.cpu.items()}
    return {
        'samples_10khz': float(wanted),
        'lost_10khz': float(wanted - len(np.unique(found[found < wanted]))),
        'core_share_10khz': sum(share.values()),
        **{f'core_share_10khz_{name}': value for name, value in share.items()},
    }


def run(seconds: float = 60.0) -> dict[str, float]:
    """Return both runs' figures; the nodes must be installed and sourced."""
    return {**twenty_times_a_second(seconds), **ten_kilohertz(30.0)}
