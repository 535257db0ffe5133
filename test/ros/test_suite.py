"""Several nodes in one process."""

import signal
import subprocess
import sys
import threading
from types import SimpleNamespace

import numpy as np
import pytest
import yaml
from ros_nodes import QUICK, RATE, recorded

from actuator_glue.nodes import base, spin
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


@pytest.mark.slow
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
    probe.until(lambda: probe.number('actuator_sim', 'samples') > 0)
    process.send_signal(signal.SIGINT)
    assert process.wait(60) == 0
    assert (tmp_path / 'bag' / 'metadata.yaml').exists()


def test_one_that_a_test_can_do_without_leaves_the_others(together, probe, tmp_path):
    bag = tmp_path / 'bag'
    process = together(
        'recorder', 'viewer', 'actuator_sim', recorder={'bag': str(bag)}, viewer={'port': 0}
    )
    probe.until(lambda: probe.number('viewer', 'messages') > 0)
    # Its first report may still be under way: a number that is none is never passed.
    probe.until(lambda: probe.number('recorder', 'messages written') > 0)
    assert probe.transition('viewer', 'shutdown')
    before = probe.number('recorder', 'messages written')
    probe.until(lambda: probe.number('recorder', 'messages written') > before + 100)
    probe.until(lambda: probe.value('viewer', 'state') == 'finalized')
    process.send_signal(signal.SIGINT)
    assert process.wait(60) == 0, (tmp_path / 'log').read_text()
    assert (bag / 'metadata.yaml').exists()


# A viewer in which everything goes wrong that nobody foresaw.
BROKEN = """
import sys
from actuator_glue.nodes import suite, viewer

class Broken(viewer.ViewerNode):
    def do_activate(self):
        super().do_activate()
        self.create_timer(0.1, lambda: 1 / 0)  # not guarded
    def do_deactivate(self):
        1 / 0
    def destroy_node(self):
        1 / 0

viewer.ViewerNode = Broken
sys.exit(suite.main(['recorder', 'viewer', 'actuator_sim', *sys.argv[1:]]))
"""


@pytest.mark.slow
def test_a_bug_in_one_of_them_leaves_the_records_whole(probe, tmp_path):
    bag = tmp_path / 'bag'
    file = tmp_path / 'parameters.yaml'
    given = {'recorder': {'bag': str(bag)}, 'viewer': {'port': 0}}
    file.write_text(yaml.safe_dump({n: {'ros__parameters': v} for n, v in given.items()}))
    with (tmp_path / 'log').open('w') as log:
        process = subprocess.Popen(
            [sys.executable, '-c', BROKEN, '--ros-args', '--params-file', str(file)],
            stdout=log,
            stderr=subprocess.STDOUT,
        )
    try:
        probe.until(lambda: probe.number('recorder', 'messages written') > 100)
        process.send_signal(signal.SIGINT)
        # The end of the broken one is told, in its log and by the exit code.
        assert process.wait(60) == 1
    finally:
        process.kill()
        process.wait()
    assert 'ZeroDivisionError' in (tmp_path / 'log').read_text()
    assert (bag / 'metadata.yaml').exists()
    index = recorded(bag)
    assert len(index) and np.array_equal(index, np.arange(index[0], index[0] + len(index)))


@pytest.mark.parametrize(
    ('carries', 'found', 'go_on'),
    [
        (False, base.ERROR, True),
        (True, base.ERROR, False),
        (False, base.FAILURE, False),
        (False, base.SUCCESS, True),
    ],
)
def test_who_cannot_start_and_what_follows(carries, found, go_on):
    """A refusal is told before a test begins; a bug ends what the test can do without, alone."""
    node = SimpleNamespace(
        carries=carries,
        parameters={'autostart': True},
        trigger_configure=lambda: base.SUCCESS,
        trigger_activate=lambda: found,
    )
    assert spin._begin(node, threading.Event()) is go_on


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
