"""A rate that is not that of the samples is told as an error, and no window passes as good."""

import numpy as np
import pytest
from actuator_glue_msgs.msg import PosteriorMoments
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from ros_nodes import QUICK, RATE
from test_live import free_port, send, write


def levels(probe):
    """Worst level that each node has shown on /diagnostics."""
    worst = {}

    def take(message):
        for status in message.status:
            node = status.name.strip('/')
            worst[node] = max(worst.get(node, DiagnosticStatus.OK), status.level)

    probe.create_subscription(DiagnosticArray, '/diagnostics', take, 50)
    return worst


@pytest.mark.slow
@pytest.mark.parametrize('layout', ['', 'counter.yaml'])
def test_a_bridge_that_is_told_half_the_rate_says_so(layout, start, probe, tmp_path):
    """The real chain: send, lab_bridge, estimator. `rate:=500` gave half of beta_1, all OK."""
    at = f'udp://127.0.0.1:{free_port()}'
    given, posteriors, worst = tmp_path / 'given', [], levels(probe)
    if layout:
        # Nothing but a counter: the rate shows in the arrival of the samples alone.
        layout = tmp_path / layout
        layout.write_text(
            'sample:\n'
            '  - {name: counter, type: uint32}\n'
            '  - {name: command, type: float64, unit: m}\n'
            '  - {name: measured, type: float64, unit: m}\n'
        )
    record = write(given, 7000, 1000.0)
    probe.create_subscription(PosteriorMoments, 'posterior', posteriors.append, 10)
    estimator = start('estimator')
    bridge = start(
        'lab_bridge',
        source=at,
        rate=500.0,
        layout=str(layout),
        specimen_stiffness=250e3,
        wait_for=1,
    )
    probe.until(lambda: 'the stream begins' in bridge.text, 250, 'estimator compiled')
    sender = send(given, at, *(['--layout', str(layout)] if layout else []))
    probe.until(lambda: probe.number('lab_bridge', 'samples') == len(record), what='all samples')
    probe.for_a_while(1.5)
    assert sender.wait(60) in (0, 1)
    clock = 'by the arrival of the samples' if layout else "by the sender's time"
    assert f'said to be 500 Hz, but {clock} it is' in probe.faults['lab_bridge']
    assert worst['lab_bridge'] == DiagnosticStatus.ERROR
    assert '[ERROR]' in bridge.text and 'sample rate' in bridge.text
    told = 'said to be 500 Hz, but by the stamps of the samples it is'
    assert told in probe.faults['estimator'] and worst['estimator'] == DiagnosticStatus.ERROR
    assert not posteriors
    assert bridge.end() == 0 and estimator.end() == 0


@pytest.mark.parametrize(
    ('factor', 'good'), [(0.5, False), pytest.param(1.0, True, marks=pytest.mark.slow)]
)
def test_a_foreign_publisher_whose_stamps_disagree(factor, good, start, probe):
    worst, posteriors = levels(probe), []
    probe.create_subscription(PosteriorMoments, 'posterior', posteriors.append, 10)
    estimator = start('estimator', **QUICK | {'window': 3.0})
    probe.until(lambda: probe.value('estimator', 'worker') == 'ready', 250, 'compiled')
    probe.open_stream()
    probe.setup()
    time = np.arange(round(6 * RATE)) / RATE
    command = 2e-3 * np.sin(2 * np.pi * 1.5 * time)
    measured = np.roll(command, 4) + 1e-5 * np.random.default_rng(1).standard_normal(len(time))
    for first in range(0, len(time), 20):
        stamp = probe.start_ns + round(factor * first / RATE * 1e9)
        part = slice(first, first + 20)
        probe.block(command[part], measured[part], stamp_ns=stamp)
        probe.for_a_while(0.02)
    samples = 'samples' if good else 'blocks rejected'
    probe.until(lambda: probe.number('estimator', samples) >= (1200 if good else 1), what=samples)
    if good:
        probe.until(lambda: len(posteriors) >= 2, what='windows')
        assert 'sample rate' not in probe.faults['estimator']
    else:
        told = 'said to be 200 Hz, but by the stamps of the samples it is 400 Hz'
        probe.until(lambda: told in probe.faults['estimator'], what=told)
        probe.for_a_while(1.0)  # for a window
        assert not posteriors
        assert worst['estimator'] == DiagnosticStatus.ERROR
        assert probe.number('estimator', 'samples lost') == 0
    assert estimator.end() == 0
