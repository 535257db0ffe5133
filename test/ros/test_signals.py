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
    return process.wait(30.0)


def test_a_doubled_signal_leaves_the_bag_whole(start, probe, tmp_path):
    bag = tmp_path / 'bag'
    recorder = start('recorder', installed=True, bag=str(bag))
    probe.open_stream()
    probe.setup()
    for _ in range(200):
        probe.block(np.zeros(500), np.zeros(500))
    for out in probe.setup_out, probe.samples_out:
        assert out.wait_for_all_acked(Duration(seconds=20.0))
    assert end_as_launch_does(recorder) == 0, recorder.text
    assert (bag / 'metadata.yaml').exists(), recorder.text
    assert np.array_equal(recorded(bag), np.arange(100_000))


def test_a_second_signal_ends_a_node_that_hangs(tmp_path):
    text = (
        'import sys, time\n'
        'from actuator_glue.nodes.signals import Stop\n'
        'stop = Stop()\n'
        'print("ready", flush=True)\n'
        'time.sleep(60)\n'
    )
    process = subprocess.Popen([sys.executable, '-c', text], stdout=subprocess.PIPE)
    assert process.stdout.readline() == b'ready\n'
    for pause in (0.1, 1.2):
        process.send_signal(signal.SIGINT)
        time.sleep(pause)
        assert process.poll() is None
    process.send_signal(signal.SIGINT)
    assert process.wait(30.0) == 130


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
    told, _ = process.communicate(timeout=20)
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
    probe.until(lambda: probe.value('diagnoser', 'last diagnosis'), 200, 'a diagnosis')
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
