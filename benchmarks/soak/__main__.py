"""All nodes for half an hour at 1 kHz, with faults at random moments.

`make soak`, or `python -m benchmarks.soak --minutes 5 --out out/soak`. Writes soak.json (schema
actuator_glue.soak/1) and soak.md; everything in them is read from the recorded bag, memory apart.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import signal
import socket
import sys
import time
from collections.abc import Callable
from contextlib import closing
from dataclasses import asdict
from pathlib import Path

import numpy as np

from actuator_glue.errors import InputError
from benchmarks.soak import judge, memory, text
from benchmarks.soak.udp_controller import RATE, STIFFNESS, Wire
from examples.demonstration.domain import own_domain
from examples.demonstration.processes import Node, Nodes, end_in_order

WIRE = ('drop_out', 'nan_burst', 'spike', 'clock_jump', 'restart', 'disorder', 'garbage')
NODES = ('estimator_killed', 'worker_killed', 'recorder_stalled')
KILLED = ('estimator_killed', 'worker_killed')
STALL = 3.0  # s
# Shares of the run: until the first, processes are killed as well; after the second, memory is
# watched. By then all kinds of faults have come, buffers are full (the viewer keeps 17 minutes),
# and nobody's growth is that of a process just born.
KILLS, WARM = 0.4, 0.6
READY_SECONDS = 400.0


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    made = argparse.ArgumentParser(prog='python -m benchmarks.soak', description=__doc__)
    made.add_argument('--minutes', type=float, default=30.0, help='length of the stream')
    made.add_argument('--seed', type=int, default=1, help='seed of the wire and of the faults')
    made.add_argument('--every', type=float, default=30.0, help='mean time between faults [s]')
    made.add_argument('--out', type=Path, default=Path('out/soak'), help='folder of the results')
    return made


class Soak:
    """One run.

    Args:
        args: from the command line.
    """

    def __init__(self, args: argparse.Namespace, nodes: Nodes) -> None:
        self.args, self.nodes = args, nodes
        self.bag = args.out / 'bag'
        self.rng = np.random.default_rng(args.seed)
        self.faults: list[judge.Fault] = []
        self.memory: list[memory.Reading] = []
        with closing(socket.socket(type=socket.SOCK_DGRAM)) as probe:
            probe.bind(('127.0.0.1', 0))
            self.port = probe.getsockname()[1]
        self.running: dict[str, Node] = {}

    def begin(self, name: str, **parameters: object) -> None:
        """Start a node."""
        self.running[name] = self.nodes.start(name, parameters, self.args.out)

    def run(self) -> None:
        """Start everything, spoil it for as long as asked, end it in order."""
        self.begin('recorder', bag=str(self.bag))
        self.begin('estimator')
        self.begin('diagnoser', automatic=False)
        self.begin('margin', partition='sdof')
        self.begin('viewer', port=0)
        self.begin(
            'lab_bridge',
            source=f'udp://127.0.0.1:{self.port}',
            rate=RATE,
            specimen_stiffness=STIFFNESS,
            wait_for=4,
        )
        until = time.monotonic() + READY_SECONDS
        log = self.running['lab_bridge'].log
        while 'the stream begins' not in log.read_text(errors='replace'):
            self.nodes.check()
            if time.monotonic() > until:
                raise SystemExit('the nodes were not ready in time; is the computer busy?')
            time.sleep(0.5)
        wire = Wire(self.port, self.args.seed)
        wire.start()
        try:
            self._spoil(wire)
        finally:
            wire.stop()
        time.sleep(5.0)

    def _spoil(self, wire: Wire) -> None:
        start = time.monotonic()
        end = start + 60.0 * self.args.minutes
        # The first windows have nothing to fall back from.
        due = start + 25.0
        order: list[str] = []
        while (now := time.monotonic()) < end:
            self._all_there()
            running = {name: node.process.pid for name, node in self.running.items()}
            self.memory += memory.read(now - start, running)
            # None so late that nothing could be seen of it any more.
            if now >= due and now < end - 25.0:
                young = now - start < KILLS * (end - start)
                kinds = [k for k in (*WIRE, *NODES) if young or k not in KILLED]
                order = [k for k in order if k in kinds] or list(self.rng.permutation(kinds))
                kind = str(order.pop())
                print(f'{now - start:7.1f} s  {kind}', flush=True)
                begun = time.time()
                seconds = self._fault(kind, wire)()
                self.faults.append(judge.Fault(kind, begun, seconds))
                due = now + seconds + self.args.every * float(self.rng.uniform(0.7, 1.3))
            time.sleep(1.0)

    def _all_there(self) -> None:
        for name, node in self.running.items():
            if not node.running:
                raise SystemExit(
                    f'{name} ended by itself ({node.process.returncode}):\n{node.last_words()}'
                )

    def _fault(self, kind: str, wire: Wire) -> Callable[[], float]:
        return getattr(self if kind in NODES else wire, kind)

    def estimator_killed(self) -> float:
        """Kill the estimator; another is started, and has to get ready first."""
        begun = time.monotonic()
        os.killpg(self.running['estimator'].process.pid, signal.SIGKILL)
        self.running['estimator'].process.wait()
        self.nodes.forget(self.running['estimator'])
        self.begin('estimator')
        log = self.running['estimator'].log
        while 'listening to samples' not in log.read_text(errors='replace'):
            self.nodes.check()
            if time.monotonic() - begun > READY_SECONDS:
                raise SystemExit('the estimator was not ready again in time')
            time.sleep(0.2)
        return time.monotonic() - begun

    def worker_killed(self) -> float:
        """Kill the process that computes; the node starts another."""
        begun = time.monotonic()
        for child in memory.children(self.running['estimator'].process.pid):
            if memory.computes(child):
                os.kill(child, signal.SIGKILL)
        return time.monotonic() - begun

    def recorder_stalled(self) -> float:
        """Stop the recorder for a while, as a disk does that does not answer."""
        process = self.running['recorder'].process
        process.send_signal(signal.SIGSTOP)
        time.sleep(STALL)
        process.send_signal(signal.SIGCONT)
        return STALL


def main() -> int:
    """Run, judge, write; 1 where a fault was not told or a band did not come back in time."""
    args = parser().parse_args()
    end_in_order()
    own_domain()
    shutil.rmtree(args.out / 'bag', ignore_errors=True)
    args.out.mkdir(parents=True, exist_ok=True)
    loads = [os.getloadavg()[0]]
    ended_early = ''
    with Nodes() as nodes:
        soak = Soak(args, nodes)
        try:
            soak.run()
        except (SystemExit, InputError) as error:
            # What was seen until then is worth as much.
            ended_early = str(error)
    loads.append(os.getloadavg()[0])
    content = judge.read(soak.bag)
    judge.judge(soak.faults, content)
    grown = memory.growth(soak.memory, WARM * 60.0 * args.minutes)
    found = {
        'schema': 'actuator_glue.soak/1',
        'minutes': args.minutes,
        'ended_early': ended_early,
        'seed': args.seed,
        'load_before_and_after': loads,
        'cores': os.cpu_count(),
        'faults': [asdict(f) for f in soak.faults],
        'memory': {name: asdict(g) for name, g in grown.items()},
        'readings': [r for r in soak.memory if int(r.seconds) % 10 == 0],
        'samples_missing_in_the_bag': judge.whole(content),
        **judge.summary(content),
    }
    (args.out / 'soak.json').write_text(json.dumps(found, indent=2) + '\n')
    report, passed = text.report(found)
    (args.out / 'soak.md').write_text(report)
    print(report)
    return 0 if passed else 1


if __name__ == '__main__':
    sys.exit(main())
