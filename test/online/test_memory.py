"""What is known before the records of a diagnosis, and which these are."""

import math
from dataclasses import replace

import numpy as np
import pytest

from actuator_glue.inference.carried import Carried
from actuator_glue.inference.choice import choose_model
from actuator_glue.model.parameters import NAMES
from actuator_glue.online.collect import Collector
from actuator_glue.online.knowledge import Known
from actuator_glue.online.memory import Memory, looked_at
from actuator_glue.online.playback import stream
from actuator_glue.online.settings import EstimatorSettings
from actuator_glue.records import Record
from actuator_glue.setups import StreamSetup


def known(seconds, beta=134.0):
    draws = np.array([beta, 1.1e9, 2.5e5, 0.5]) * np.linspace(0.99, 1.01, 60)[:, None]
    at = round(seconds * 1e9)
    return Known(Carried(NAMES, draws), at - 2_500_000_000, at)


def test_each_sample_counts_once_in_what_is_known_before_records():
    memory = Memory()
    assert memory.before(0) is None
    settings = EstimatorSettings(prior='sequential', drift=0.06, prior_age=1800.0)
    memory.setup(settings, known(0.0, 100.0).carried)
    memory.began(0)
    for second in range(5, 60):
        memory.learn(known(float(second), 100.0 + second), None)
    # Records that go back to the beginning: the calibration, as old as it is.
    draws, drift, age = memory.before(0)
    assert draws.draws[:, 0].mean() == pytest.approx(100.0) and age == 1800.0
    assert draws.spread[0] == pytest.approx(0.06 * math.sqrt(0.5)) and drift.every == 0.06
    # Records that begin at 40 s: the newest posterior that ended before them.
    draws, _, age = memory.before(40_000_000_000)
    assert draws.draws[:, 0].mean() == pytest.approx(139.0) and age == pytest.approx(3.5)


def test_what_an_estimator_from_the_box_says_of_a_window_is_no_knowledge():
    memory = Memory()
    memory.setup(EstimatorSettings(), None)
    memory.learn(known(5.0), None)
    assert memory.before(10**12) is None


def test_memory_of_posteriors_is_bounded():
    memory = Memory()
    memory.setup(EstimatorSettings(prior='sequential'), None)
    for second in range(5, 5000):
        memory.learn(known(float(second)), max(0, second - 180) * 1_000_000_000)
    assert len(memory._known) < 200


def test_what_a_look_is_of_begins_where_the_estimator_knows_what_was_before():
    command = 1e-3 * np.sin(np.linspace(0.0, 300.0, 6000))
    collector, memory = Collector(180.0), Memory()
    for item in stream(Record(command, command, 0.01, 250e3, start_ns=10**18), 50):
        collector.setup(item) if isinstance(item, StreamSetup) else collector.push(item)
    assert collector.received == 60.0
    start = collector.first_ns
    memory.setup(EstimatorSettings(prior='sequential'), known(0.0, 100.0).carried)
    memory.began(start)
    memory.learn(replace(known(0.0), middle_ns=start, last_ns=start + 44_000_000_000), start)
    (record,), (learned, _, age) = looked_at(collector, memory, 45.0)
    assert record.duration == 15.0 and record.start_ns == start + 45_000_000_000
    assert age == 45.0 and learned.draws[:, 0].mean() == pytest.approx(134.0)
    (record,), (calibrated, _, age) = looked_at(collector, memory, 0.0)
    assert record.duration == 60.0
    assert age == 0.0 and calibrated.draws[:, 0].mean() == pytest.approx(100.0)
    assert looked_at(Collector(9.0), memory, 0.0) == ([], None)


def test_of_what_is_learned_without_a_calibration_what_windows_tell_is_handed_over():
    """Where one stiffness leaves alpha_2 open its posterior is the box: 7 +- 1.5 MN/m, not 0.3."""
    memory = Memory()
    memory.setup(EstimatorSettings(prior='sequential'), None)
    rng, (lower, upper) = np.random.default_rng(1), choose_model().bounds
    draws = rng.uniform(lower, upper, (400, 4))
    at = known(44.0)
    memory.learn(replace(at, carried=Carried(NAMES, draws)), 0)
    assert memory.before(45_000_000_000) is None
    draws[:, 0] = rng.normal(134.0, 0.3, 400)
    memory.learn(replace(at, carried=Carried(NAMES, draws)), 0)
    learned, _, _ = memory.before(45_000_000_000)
    assert learned.names == ('beta_1',) and learned.draws.mean() == pytest.approx(134.0, rel=1e-3)
    assert memory.before(44_000_000_000) is None


def test_what_is_learned_after_the_clock_went_back_is_known():
    """Posteriors from before that are of times that say no longer what was earlier."""
    memory = Memory()
    memory.setup(EstimatorSettings(prior='sequential'), known(0.0, 100.0).carried)
    for second in range(1000, 1100):
        memory.learn(known(float(second), 110.0), 950 * 10**9)
    for second in range(500, 600):
        # What is kept still begins with records of the old clock.
        memory.learn(known(float(second), 120.0 + 0.1 * (second - 500)), 960 * 10**9)
    draws, _, age = memory.before(550 * 10**9)
    assert draws.draws[:, 0].mean() == pytest.approx(124.9) and age == pytest.approx(3.5)
    draws, _, _ = memory.before(400 * 10**9)
    assert draws.draws[:, 0].mean() == pytest.approx(100.0)


def test_no_sample_counts_twice_where_the_clock_went_back():
    """Records of both clocks: posteriors of the second seem to precede the first."""
    command = 1e-3 * np.sin(np.linspace(0.0, 300.0, 6000))
    collector, memory = Collector(180.0), Memory()
    first = Record(command, command, 0.01, 250e3, start_ns=10**18)
    second = replace(first, start_ns=10**18 - 200 * 10**9, first_index=6000)
    for part in (first, second):
        for item in stream(part, 50):
            collector.setup(item) if isinstance(item, StreamSetup) else collector.push(item)
    memory.setup(EstimatorSettings(prior='sequential'), known(0.0, 100.0).carried)
    memory.began(first.start_ns)
    for part in (first, second):
        for after in range(10, 60, 5):
            end = part.start_ns + after * 10**9
            memory.learn(replace(known(0.0), middle_ns=end, last_ns=end), collector.first_ns)
    records, (draws, _, _) = looked_at(collector, memory, 0.0)
    assert [record.start_ns for record in records] == [first.start_ns, second.start_ns]
    assert draws.draws[:, 0].mean() == pytest.approx(100.0)
    (record,), (draws, _, age) = looked_at(collector, memory, 90.0)
    assert record.start_ns == second.start_ns + 30 * 10**9
    assert draws.draws[:, 0].mean() == pytest.approx(134.0) and age == pytest.approx(5.0)
