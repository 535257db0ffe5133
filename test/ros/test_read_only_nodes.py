"""Nodes where nothing but one folder can be written and nobody has a home."""

import os
import signal
import subprocess
from pathlib import Path

import pytest
from ros_nodes import executable
from test_live import free_port

from actuator_glue.nodes import parameter_file

BAGS = Path(__file__).resolve().parents[2] / 'bags'


@pytest.fixture
def begin(read_only, tmp_path):
    """Start an executable there; whatever still runs at the end is killed."""
    running = []

    def start(name, *args):
        log = (tmp_path / 'log').open('w')
        process = subprocess.Popen(
            read_only(executable(name), *args), stdout=log, stderr=subprocess.STDOUT
        )
        running.append(process)
        return process

    yield start
    for process in running:
        process.kill()
        process.wait()


def parameters(**values):
    """The part of a command line that sets parameters."""
    return ['--ros-args', *(a for k, v in values.items() for a in ('-p', f'{k}:={v}'))]


@pytest.mark.slow
def test_all_that_listens_runs_on_a_read_only_disk(begin, probe, tmp_path):
    """In one process, whose start takes long; the bag goes where it may."""
    bag = tmp_path / 'out' / 'bag'
    # What only one of them has: recorder, viewer, margin.
    given = parameters(bag=bag, port=0, partition='sdof')
    names = ('recorder', 'estimator', 'diagnoser', 'margin', 'viewer', 'actuator_sim')
    process = begin('suite', *names, *given)
    probe.until(lambda: all(probe.value(n, 'state') == 'active' for n in names), 250, 'active')
    process.send_signal(signal.SIGINT)
    text = (tmp_path / 'log').read_text()
    assert process.wait(60) == 0, text
    assert (bag / 'metadata.yaml').exists()
    assert 'Traceback' not in text and 'logs go to' in text
    assert (tmp_path / 'out' / f'ros_log_{os.getuid()}').is_dir()


def test_a_bag_without_a_name_needs_a_home_and_says_so(begin, tmp_path):
    process = begin('recorder')
    assert process.wait(60) == 2
    text = (tmp_path / 'log').read_text()
    assert 'read-only' in text and 'parameter bag' in text and 'Traceback' not in text
    assert 'kept' not in text  # nothing was


@pytest.mark.slow
@pytest.mark.parametrize('node', sorted(parameter_file.NODES))
def test_each_node_starts_on_a_read_only_disk(node, begin, probe, tmp_path):
    given = {
        'recorder': {'bag': tmp_path / 'out' / 'bag'},
        'margin': {'partition': 'sdof'},
        'viewer': {'port': 0},
        'lab_bridge': {
            'source': f'udp://127.0.0.1:{free_port()}',
            'rate': 500.0,
            'specimen_stiffness': 0.0,
        },
        'replay': {'bag': BAGS / 'free', 'wait_for': 9},
    }
    process = begin(node, *parameters(**given.get(node, {})))
    probe.until(lambda: probe.value(node, 'state') == 'active', 250, 'active')
    process.send_signal(signal.SIGINT)
    assert process.wait(60) == 0
    assert 'Traceback' not in (tmp_path / 'log').read_text()
