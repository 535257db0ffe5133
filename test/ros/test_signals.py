"""Signals as launch, `timeout` and a shell's process group send them: twice, early, mixed."""

import os
import re
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from rclpy.duration import Duration
from ros_nodes import executable, recorded

from actuator_glue.io.bag_reader import decoded
from actuator_glue.nodes import parameter_file, run


def end_as_launch_does(process):
    """A SIGINT to the process and one to its group, then SIGTERM; return the exit status."""
    os.kill(process.process.pid, signal.SIGINT)
    time.sleep(0.02)
    os.killpg(process.process.pid, signal.SIGINT)
    time.sleep(0.02)
    os.kill(process.process.pid, signal.SIGTERM)
    return process.wait(60)


def test_a_doubled_signal_leaves_the_bag_whole(start, probe, tmp_path):
    bag = tmp_path / 'bag'
    recorder = start('recorder', installed=True, bag=str(bag))
    probe.open_stream()
    probe.setup()
    for _ in range(200):
        probe.block(np.zeros(500), np.zeros(500))
    for out in probe.setup_out, probe.samples_out:
        assert out.wait_for_all_acked(Duration(seconds=60.0))
    assert end_as_launch_does(recorder) == 0, recorder.text
    assert (bag / 'metadata.yaml').exists(), recorder.text
    assert np.array_equal(recorded(bag), np.arange(100_000))


# Hangs; when it looks, and whether for a signal or in vain, is given.
HANGS = """
import select, sys, time
from types import SimpleNamespace
from actuator_glue.nodes import signals

looks, now = iter(sys.argv[1:]), [10.0]

def look(readers, *_):
    kind, _, at = next(looks).partition(' ')
    found = []
    if kind == 'signal':
        print('waits', flush=True)
        found = select.select(readers, [], [])[0]
    now[0] = float(at)
    return found, [], []

signals.time = SimpleNamespace(monotonic=lambda: now[0])
signals.select = SimpleNamespace(select=look)
stop = signals.Stop()
time.sleep(300)
"""


@pytest.mark.parametrize('again', [10.04, 13.0])
def test_a_second_signal_ends_a_node_that_hangs(again):
    """One that comes within a second is a repetition, also where nobody looks for longer."""
    ticks = [f'tick {again + 0.05 * i:.2f}' for i in range(1, 21)]
    looks = ['signal 10.0', f'signal {again}', *ticks, 'signal 20.0']
    process = subprocess.Popen(
        [sys.executable, '-c', HANGS, *looks], stdout=subprocess.PIPE, text=True
    )
    for _ in range(3):
        assert process.stdout.readline() == 'waits\n'
        process.send_signal(signal.SIGINT)
    assert process.wait(60.0) == 130


# A signal comes between any two steps that take signals over.
EARLY = """
import os, signal, sys
from actuator_glue.nodes import signals

signals.end_at_once()
step, steps, real = int(sys.argv[1]), 0, (signal.signal, signal.set_wakeup_fd)

def then_a_signal(do):
    def call(*args, **given):
        global steps
        found = do(*args, **given)
        steps += 1
        if steps == step:
            os.kill(os.getpid(), signal.SIGINT)
        return found
    return call

signal.signal, signal.set_wakeup_fd = map(then_a_signal, real)
stop = signals.Stop()
assert steps == 3 and stop._event.wait(60.0), 'the signal was lost'
"""


@pytest.mark.parametrize('step', [1, 2, 3])
def test_no_signal_is_lost_while_a_node_takes_them_over(step):
    done = subprocess.run(
        [sys.executable, '-c', EARLY, str(step)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize('after', [0.3, 0.6, 1.2])
def test_an_early_signal_ends_a_node_without_a_traceback(after, tmp_path):
    """While its libraries are imported, or its worker begins."""
    text = (
        'import sys\n'
        'from actuator_glue.nodes import run\n'
        'print("ready", flush=True)\n'
        'if __name__ == "__main__":\n'
        '    sys.exit(run.estimator())\n'
    )
    script = tmp_path / 'estimator'
    script.write_text(text)
    process = subprocess.Popen(
        [sys.executable, str(script)],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        start_new_session=True,
        text=True,
    )
    assert process.stdout.readline() == 'ready\n'
    time.sleep(after)
    for _ in range(2):
        os.killpg(process.pid, signal.SIGINT)
    told, _ = process.communicate(timeout=120)
    assert process.returncode == 0 and 'Traceback' not in told, told


@pytest.mark.slow
@pytest.mark.timeout(1500)
def test_the_first_run_on_a_machine_is_whole(start, probe, tmp_path, monkeypatch):
    """An empty compile cache, all nodes at once, signals as launch sends them."""
    monkeypatch.setenv('NUMBA_CACHE_DIR', str(tmp_path / 'cache'))
    bag, sealed = tmp_path / 'bag', tmp_path / 'truth.json'
    nodes = [
        start('recorder', installed=True, bag=str(bag)),
        start('estimator', installed=True, window=4.0, hop=2.0, time_budget=1.8),
        start('diagnoser', installed=True, minimum=10.0),
        start(
            'actuator_sim',
            installed=True,
            rate=200.0,
            duration=90.0,
            wait_for=3,
            preview=3.0,
            undeclared_effect='backlash:backlash=1e-4',
            sealed_file=str(sealed),
        ),
    ]
    probe.until(lambda: probe.number('estimator', 'windows') >= 5, 1200, 'windows')
    probe.until(lambda: probe.value('diagnoser', 'last diagnosis'), 250, 'a diagnosis')
    assert probe.number('estimator', 'windows dropped') <= 3
    for node in reversed(nodes):
        assert end_as_launch_does(node) == 0, node.text
    assert (bag / 'metadata.yaml').exists()
    assert list(decoded(bag, ('PosteriorMoments',))) and list(decoded(bag, ('Diagnosis',)))


@pytest.mark.parametrize('node', parameter_file.NODES)
def test_every_node_has_an_executable(node):
    """Each calls its own function, by the one script that setuptools writes for all."""
    assert callable(getattr(run, node))
    found = executable(node)
    assert os.access(found, os.X_OK)
    assert re.search(rf'\b{node}\b', found.read_text())
