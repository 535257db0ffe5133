"""What a soak is judged by: a fault not told, a band that stays bad, memory that grows."""

import gc
import os
from dataclasses import asdict

import numpy as np

from benchmarks.soak import judge, memory, text
from benchmarks.soak.judge import Content, Fault


def content(bands=(), **reports):
    """Content of a bag, reports once a second."""
    return Content({n: list(r) for n, r in reports.items()}, list(bands), [], [])


def test_a_fault_counts_as_told_when_its_count_grows():
    quiet = [(float(t), {'lost': '5'}) for t in range(100)]
    loud = [(float(t), {'lost': '5' if t < 53 else '9'}) for t in range(100)]
    for reports, told in ((quiet, False), (loud, True)):
        fault = Fault('drop_out', 50.0, 1.0)
        judge.judge([fault], content(lab_bridge=reports))
        assert fault.told is told


def test_a_band_is_back_after_the_last_bad_one():
    bands = [(float(t), 0.5 if 52 <= t < 58 else 0.95) for t in range(100)]
    fault, never = Fault('spike', 50.0, 1.0), Fault('spike', 200.0, 1.0)
    judge.judge([fault, never], content(bands))
    assert fault.back == 7.0 and np.isnan(never.back)
    # Where no band comes there is none that is good.
    hole = [b for b in bands if not 52 <= b[0] < 58]
    fault = Fault('spike', 50.0, 1.0)
    judge.judge([fault], content([(51.5, 0.95), *hole]))
    assert fault.back == 7.0
    # Nor where none came any more until the next fault.
    fault, second = Fault('worker_killed', 50.0, 0.0), Fault('spike', 70.0, 0.0)
    judge.judge([fault, second], content([b for b in bands if b[0] < 52 or b[0] > 75]))
    assert np.isnan(fault.back) and second.back == 6.0
    # One that is bad only after the next fault is that one's.
    first, second = Fault('spike', 50.0, 1.0), Fault('spike', 55.0, 0.0)
    late = [(t, 0.5 if 55 < t < 58 else 0.95) for t, _ in bands]
    judge.judge([first, second], content([(51.5, 0.95), *[b for b in late if b[0] > 51.5]]))
    assert first.back == 0.5 and second.back == 3.0


def test_a_recorder_that_stands_still_is_seen_by_its_silence():
    reports = [(float(t), {}) for t in range(100) if not 50 < t < 54]
    stalled, not_stalled = (
        Fault('recorder_stalled', 50.5, 3.0),
        Fault('recorder_stalled', 20.5, 3.0),
    )
    judge.judge([not_stalled, stalled], content(recorder=reports))
    assert stalled.told and not not_stalled.told


def readings(part, megabytes, seconds=1800, process=1, begin=0.0):
    """What a process of a part takes, by its age in seconds."""
    return [memory.Reading(begin + t, part, process, megabytes(t)) for t in range(seconds)]


def test_memory_that_grows_is_told_per_hour(rng_seed):
    rng = np.random.default_rng(rng_seed)
    noise = 0.05 * rng.standard_normal(1800)
    found = memory.growth(
        [
            *readings('grows', lambda t: 100.0 + t / 600 + noise[t]),
            *readings('rests', lambda t: 50.0 + noise[t]),
            # As a writer does that begins a new file every five minutes.
            *readings('saw', lambda t: 50.0 + (t % 300) / 330),
        ],
        450.0,
    )
    grows, rests, saw = (found[name] for name in ('grows', 'rests', 'saw'))
    assert abs(grows.slope - 6.0) < 0.3 and grows.lower > 5.0
    assert abs(rests.slope) < 0.3 and rests.upper < 1.0
    assert abs(saw.slope) < 1.0


def test_each_process_has_its_own_growth():
    """One that is replaced starts low again; what grows in each still shows, what rests too."""
    for slope in (0.0, 12.0):
        runs = [
            readings('estimator', lambda t, s=slope: 90.0 + s * t / 3600, 400, n, 400.0 * n)
            for n in range(4)
        ]
        found = memory.growth([r for run in runs for r in run], 100.0)['estimator']
        assert abs(found.slope - slope) < 0.1 and found.processes == 4


def test_one_step_is_no_growth():
    found = memory.growth(readings('node', lambda t: 50.0 + 2.0 * (t > 600)), 450.0)['node']
    assert abs(found.slope) < 1e-9


def test_memory_of_this_process_is_read():
    gc.collect()  # what is freed meanwhile is no growth
    before = memory.anonymous(os.getpid())
    ballast = np.ones(16_000_000)
    assert 90.0 < memory.anonymous(os.getpid()) - before < 200.0
    assert np.isnan(memory.anonymous(0)) and ballast.all()


def grown(slope, lower, upper):
    """Growth of a part."""
    return asdict(memory.Growth(slope, lower, upper, 60.0, 1))


def result(**more):
    """What a run leaves, all well unless told otherwise."""
    return {
        'minutes': 1.0,
        'seed': 1,
        'cores': 2,
        'load_before_and_after': [0.0, 0.0],
        'faults': [{'kind': 'spike', 'told': True, 'back': 3.0}],
        'memory': {'recorder': grown(0.1, 0.0, 0.2)},
        'samples_missing_in_the_bag': 0,
        'ended_early': '',
        'good_bands_per_hop': 0.8,
        'estimator': {},
        'worst_write_lag_s': '0.1',
        'callback_delay_s': {'median': 1e-4, 'p99': 1e-3},
        **more,
    }


def test_the_headline_says_what_the_numbers_say():
    assert text.report(result())[1]
    for bad in (
        {'faults': [{'kind': 'spike', 'told': False, 'back': 3.0}]},
        {'faults': [{'kind': 'spike', 'told': True, 'back': 30.0}]},
        {'faults': [{'kind': 'spike', 'told': True, 'back': float('nan')}]},
        {'memory': {'recorder': grown(9.0, 8.0, 10.0)}},
        {'memory': {'recorder': grown(0.5, -9.0, 9.0)}},
        {'samples_missing_in_the_bag': 1},
        {'ended_early': 'the estimator was not ready again in time'},
    ):
        page, passed = text.report(result(**bad))
        assert not passed and page.startswith('**Not everything held')
