"""Alarms and news of a test, with their times."""

import pytest
from stream import block, feed, health, intake, posterior

from actuator_glue.view.intake import Intake
from actuator_glue.view.logbook import REMEMBERED, Logbook

PERIOD = 1e-3
SOON = round(REMEMBERED / PERIOD)


def told(log: Logbook, at: float, most: int = 99) -> list[tuple]:
    """Return (start, stop, text) of what was known at a time [s]."""
    found = log.told(round(at / PERIOD), PERIOD, most)
    return [(entry['start'], entry['stop'], entry['text']) for entry in found]


def test_an_alarm_that_is_said_again_soon_is_one() -> None:
    log = Logbook()
    for at in (1000, 2000, 9000, 30_000):
        log.alarm(at, SOON, '/estimator', 'prior', 1, f'at {at}')
    assert told(log, 60.0) == [(30.0, 30.0, 'at 30000'), (1.0, 9.0, 'at 1000')]
    # It lasts for as long as the node remembers it; at 5 s nobody knows how long.
    assert told(log, 5.0) == told(log, 18.9) == [(1.0, None, 'at 1000')]
    assert told(log, 0.9) == []
    assert log.counted(19_500, PERIOD) == (1, 0)


def test_a_warning_that_becomes_an_error_is_another_alarm() -> None:
    log = Logbook()
    log.alarm(1000, SOON, '/estimator', 'silence', 1, 'ten seconds')
    log.alarm(2000, SOON, '/estimator', 'silence', 2, 'thirty')
    assert [text for _, _, text in told(log, 3.0)] == ['thirty', 'ten seconds']


def test_the_newest_stay_and_what_lasts_is_told_however_old() -> None:
    log = Logbook()
    log.alarm(0, SOON, '/estimator', 'prior', 1, 'lasts')
    for at in range(1, 2000):
        log.news(at, 'diagnosis', f'found {at}')
        log.alarm(at, SOON, '/estimator', 'prior', 1, 'lasts')
    assert len(told(log, 1e3, 10**6)) == 500
    log = Logbook()
    log.alarm(0, SOON, '/estimator', 'prior', 1, 'lasts')
    for at in range(1, 30):
        log.news(at, 'diagnosis', f'found {at}')
    assert [text for _, _, text in told(log, 0.5, 2)] == ['found 29', 'found 28', 'lasts']


def entries(made: Intake, at: float) -> list[tuple]:
    """Return (time, level, text) of the alarms that a page shows at a time."""
    log = made.history.log.told(round(at * 1e3), PERIOD, 99)
    return [(e['start'], e['level'], e['text']) for e in log if e['level']]


def test_each_fault_that_a_node_counts_is_an_alarm_of_its_own() -> None:
    """Also one that a worse one hides; what a node counted before it was heard is no news."""
    made = intake(0.0)
    feed(made, 0, 900)
    made.take('DiagnosticArray', health('/a', b'\0', 'active', deadline=3))
    assert entries(made, 1.0) == []
    made.take('DiagnosticArray', health('/a', b'\1', 'late', deadline=4, prior=1))
    assert entries(made, 1.0) == [(0.9, 1, 'late'), (0.9, 1, 'late')]
    made.take('DiagnosticArray', health('/b', b'\2', 'lost', silence=2))
    assert entries(made, 1.0)[0] == (0.9, 2, 'lost')


def test_news_of_explanations_come_when_others_are_carried_or_lead() -> None:
    made = intake(0.0)
    course = ((1.0, 0.0), (0.6, 0.4), (0.55, 0.45), (0.3, 0.7), (0.0, 1.0))
    for window, (plain, play) in enumerate(course):
        weights = {n: w for n, w in (('Eq2', plain), ('backlash', play)) if w}
        made.take('SampleBlock', block(500 * window, 500))
        made.take('PosteriorMoments', posterior(window, **weights))
    log = made.history.log.told(10**6, PERIOD, 99)
    assert [(e['start'], e['text']) for e in reversed(log)] == [
        (pytest.approx(0.5), 'Eq. (2) 100 %'),
        (pytest.approx(1.0), 'Eq. (2) 60 %, backlash 40 %'),
        (pytest.approx(2.0), 'backlash 70 %, Eq. (2) 30 %'),
        (pytest.approx(2.5), 'backlash 100 %'),
    ]
