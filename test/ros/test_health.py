"""What /diagnostics and the log say of faults."""

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticStatus

from actuator_glue.nodes.health import LOGGED_PER_SECOND, REMEMBER, Health, Rate


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
