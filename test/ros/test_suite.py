"""Several nodes in one process."""

import signal
import subprocess
import sys

import numpy as np
import pytest
import yaml
from ros_nodes import QUICK, RATE, recorded

from actuator_glue.nodes.parameter_file import NODES as KNOWN
from actuator_glue.nodes.suite import NODES, main


@pytest.fixture
def together(tmp_path):
    """Start nodes in one process; whatever still runs at the end is killed."""
    running = []

    def begin(*names, **parameters):
        file = tmp_path / 'parameters.yaml'
        content = {f'/**/{n}': {'ros__parameters': values} for n, values in parameters.items()}
        file.write_text(yaml.safe_dump(content))
        command = [sys.executable, '-m', 'actuator_glue.nodes.suite', *names]
        log = (tmp_path / 'log').open('w')
        running.append(
            subprocess.Popen(
                [*command, '--ros-args', '--params-file', str(file)],
                stdout=log,
                stderr=subprocess.STDOUT,
                cwd=tmp_path,
            )
        )
        return running[-1]

    yield begin
    for process in running:
        process.kill()
        process.wait()


def test_one_process_holds_a_whole_test(together, probe, tmp_path):
    bag = tmp_path / 'bag'
    process = together(
        'actuator_sim',
        'estimator',
        'recorder',
        recorder={'bag': str(bag)},
        estimator=QUICK,
        actuator_sim={'rate': RATE, 'duration': 6.0, 'wait_for': 2, 'exit_at_end': True},
    )
    probe.until(lambda: probe.number('estimator', 'windows') >= 3, 250, 'windows')
    # The stream's end ends all, after the last windows.
    assert process.wait(60) == 0, (tmp_path / 'log').read_text()
    assert np.array_equal(recorded(bag), np.arange(1401))
    assert (bag / 'metadata.yaml').exists()
    assert 'Traceback' not in (tmp_path / 'log').read_text()


def test_a_signal_ends_all_of_them(together, probe, tmp_path):
    process = together('recorder', 'actuator_sim', recorder={'bag': str(tmp_path / 'bag')})
    probe.until(lambda: probe.number('actuator_sim', 'samples') > 0, 60)
    process.send_signal(signal.SIGINT)
    assert process.wait(20) == 0
    assert (tmp_path / 'bag' / 'metadata.yaml').exists()


def test_one_that_cannot_start_ends_all_of_them(together, tmp_path):
    process = together('recorder', 'lab_bridge', recorder={'bag': str(tmp_path / 'bag')})
    assert process.wait(60) == 2
    assert 'give a laboratory file or a bag' in (tmp_path / 'log').read_text()


@pytest.mark.parametrize('names', [[], ['recorder', 'recorder'], ['no-such']])
def test_names_that_cannot_be_run_are_told(names, capsys):
    assert main(names) == 2
    assert 'usage: suite NODE...' in capsys.readouterr().err


def test_every_node_can_be_one_of_them():
    assert set(NODES) == set(KNOWN) | {'viewer'}
