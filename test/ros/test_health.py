"""What /diagnostics and the log say of faults."""

import time
from types import SimpleNamespace

import numpy as np
import pytest
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticStatus
from ros_nodes import NotReady

from actuator_glue.inference.choice import choose_model
from actuator_glue.inference.prior_conflict import Conflict
from actuator_glue.nodes import estimator
from actuator_glue.nodes.estimator_worker import Afterwards
from actuator_glue.nodes.health import LOGGED_PER_SECOND, REMEMBER, Health, Rate
from actuator_glue.nodes.silence import Silence
from actuator_glue.online.job import WindowResult
from actuator_glue.online.stream import Contradicted, Window
from actuator_glue.records import Record


def values(health, now):
    """Level, message and values of a report."""
    (status,) = health.message(now, Time(), 'active').status
    return status.level, status.message, {v.key: v.value for v in status.values}


def test_a_flood_of_faults_is_counted_but_hardly_logged():
    health = Health('/node')
    logged = sum(health.fault('bad input', f'block {i}', 1e-3 * i) for i in range(1000))
    assert logged == LOGGED_PER_SECOND
    level, message, shown = values(health, 1.0)
    assert level == DiagnosticStatus.WARN and message == 'block 999'
    assert shown['bad input (count)'] == '1000' and shown['bad input (last)'] == 'block 999'
    assert health.fault('gap', 'a gap', 1.0) and not health.fault('gap', 'a gap', 1.5)
    assert health.fault('gap', 'another gap', 1.6)


def test_a_fault_is_shown_for_a_while_and_the_worst_first():
    health = Health('/node')
    health.fault('disk', 'disk full', 0.0, DiagnosticStatus.ERROR)
    health.fault('gap', 'a gap', 1.0)
    assert values(health, 2.0)[:2] == (DiagnosticStatus.ERROR, 'disk full')
    assert values(health, REMEMBER + 0.5)[:2] == (DiagnosticStatus.WARN, 'a gap')
    assert values(health, REMEMBER + 5.0)[:2] == (DiagnosticStatus.OK, 'active')


def test_the_rate_is_of_the_last_reports():
    rate = Rate()
    for second in range(20):
        rate.add(100 if second < 10 else 50)
        last = rate.per_second(float(second))
    assert last == 50.0 and rate.count == 1500


class Node:
    """What a node is for `Silence`."""

    def __init__(self):
        self.health = Health('/node')
        self.now = 0.0

    def complain(self, kind, message, level=DiagnosticStatus.WARN):
        self.health.fault(kind, message, self.now, level)

    def level(self, silence, now):
        self.now = now
        silence.tell(self, 'samples', now)
        return values(self.health, now)[:2]


def test_a_minute_of_silence_is_an_error():
    node, silence = Node(), Silence(100.0)
    silence.heard(100.0)
    assert node.level(silence, 105.0) == (DiagnosticStatus.OK, 'active')
    assert node.level(silence, 115.0) == (DiagnosticStatus.WARN, 'nothing comes on samples')
    level, message = node.level(silence, 160.0)
    assert level == DiagnosticStatus.ERROR and 'samples for 30 s and more' in message
    assert values(node.health, 160.0)[2]['nothing for (s)'] == '60'
    silence.heard(160.0)
    assert node.level(silence, 165.0)[0] == DiagnosticStatus.ERROR  # remembered for a while
    silence.heard(165.0)
    assert node.level(silence, 161.0 + REMEMBER)[0] == DiagnosticStatus.OK


def test_what_has_never_come_is_waited_for():
    node, silence = Node(), Silence(100.0)
    assert node.level(silence, 105.0)[0] == DiagnosticStatus.OK
    assert node.level(silence, 190.0) == (
        DiagnosticStatus.WARN,
        'nothing comes on samples yet',
    )


@pytest.fixture
def node(probe):
    """An estimator in this process, active; nothing is published to it."""
    made = estimator.EstimatorNode()
    made.trigger_configure()
    made.trigger_activate()
    yield made
    made.trigger_shutdown()
    made.destroy_node()


def result(node, number, *, converged=True, beta_1=134.0, rate=200.0, p_value=None):
    """A window's result with a posterior about a beta_1, alpha_1_beta_0 / alpha_2 = 4400."""
    rng = np.random.default_rng(number)
    theta = np.array([beta_1, 1.1e9, 2.5e5, 0.5])
    draws = theta * np.exp(0.01 * rng.standard_normal((50, 4)))
    command = np.sin(np.arange(100.0))
    record = Record(command, command, 1 / rate, 250e3, start_ns=10**18 + number * 10**9)
    return WindowResult(
        window=Window(number, record, 0, 0, record),
        settings=node.settings,
        model=choose_model(),
        frozen=SimpleNamespace(draws=draws),
        converged=converged,
        rhat=np.ones(4),
        conflict=None if p_value is None else Conflict(30.0, 3, p_value),
        prior_dominated=(False,) * 4,
    )


def told(node, *results):
    """What /diagnostics shows after windows."""
    for one in results:
        node.last = one
        node.judged.append(one.converged)
        node.compute.append(0.1)
        node.latency.append(0.1)
    node.do_report()
    return values(node.health, time.monotonic())


def test_windows_that_do_not_converge_are_a_warning(node):
    level, _, shown = told(node, *(result(node, n, converged=n % 3 > 0) for n in range(10)))
    assert 'sampling (last)' not in shown and shown['converged windows'] == '6 of 10'
    level, message, shown = told(node, *(result(node, n, converged=False) for n in range(4)))
    assert level == DiagnosticStatus.WARN and 'have not converged' in message
    assert shown['converged windows'] == '4 of 10'


def test_a_rate_too_low_for_the_loop_is_a_warning(node):
    assert 'doubt (last)' not in told(node, result(node, 0))[2]
    level, message, _ = told(node, result(node, 1, rate=10.0))
    assert level == DiagnosticStatus.WARN
    assert 'faster than 10 Hz can show' in message


def test_channels_that_cannot_be_right_are_a_warning_until_they_can(node):
    for fault in 'the channels are swapped', 'the channels are swapped':
        node._take_afterwards(Afterwards(fault, None))
    level, message, _ = told(node, result(node, 0))
    assert level == DiagnosticStatus.WARN and message.startswith('the channels are swapped')
    node._take_afterwards(Afterwards('', None))
    assert told(node, result(node, 1))[2]['channels (count)'] == '1'


def test_a_contradicted_prior_is_told_with_its_date_for_as_long_as_it_stands(node):
    window = result(node, 5, p_value=1e-9)
    node.contradiction.take(window, [Contradicted(5, 0, 1e-9, 'window 5 contradicts')])
    level, message, shown = told(node, window)
    assert level == DiagnosticStatus.WARN
    assert message == 'samples contradict what was known, since 2001-09-09 01:46:45 UTC'
    assert float(shown['prior contradicted for (s)']) == pytest.approx(0.495)
    later = result(node, 9, p_value=1e-9)
    node.contradiction.take(later, [])
    shown = told(node, later)[2]
    assert float(shown['prior contradicted for (s)']) == pytest.approx(4.495)
    agrees = result(node, 12, p_value=0.5)
    node.contradiction.take(agrees, [])
    assert 'prior contradicted for (s)' not in told(node, agrees)[2]


def test_a_worker_that_compiles_is_no_health(node):
    node.worker.ready = NotReady()
    level, message, shown = told(node)
    assert level == DiagnosticStatus.WARN and 'still compiling' in message
    assert shown['worker'] == 'compiling'
