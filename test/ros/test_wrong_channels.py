"""Channels that cannot be right: the estimator says so while it lasts, and no longer."""

from dataclasses import replace

import numpy as np
from actuator_glue_msgs.msg import PosteriorMoments
from ros_nodes import QUICK, RATE

from actuator_glue.model import linear
from actuator_glue.model.commands import noise
from actuator_glue.records import Record

TOLD = 'moves against the command'


def motion(seconds):
    command = noise(RATE, seconds, 0.2, 8.0, seed=1)
    theta = [134.0, 1.1e9, 2.5e5, 0.5]
    measured = linear.simulate(np.array(theta), command, stiffness=250e3, period=1 / RATE)
    sensor = 1e-5 * np.random.default_rng(1).standard_normal(len(measured))
    return Record(command, measured + sensor, 1 / RATE, 250e3)


def test_a_sign_is_told_until_it_is_mended(start, probe):
    estimator = start('estimator', diagnostics_period=0.2, **QUICK)
    probe.until(lambda: probe.value('estimator', 'worker') == 'ready', 250, 'estimator compiled')
    doubts = []
    probe.create_subscription(
        PosteriorMoments, 'posterior', lambda message: doubts.append(message.doubts), 50
    )
    probe.open_stream()
    probe.setup()
    record = motion(27.0)
    at = 0

    def stream(seconds, sign):
        nonlocal at
        part = record.slice(at, at + round(seconds * RATE))
        at += len(part)
        probe.stream(replace(part, measured=sign * part.measured), pause=0.05)

    # Two stretches of five seconds; on a busy computer the set-up comes later than first samples.
    stream(14.0, -1.0)
    probe.until(lambda: TOLD in probe.faults['estimator'], what='complaint')
    assert not doubts[0]
    stream(7.0, 1.0)

    def count():
        return int(probe.value('estimator', 'channels (count)', 0))

    probe.until(lambda: probe.number('estimator', 'samples') >= at, what='samples')
    probe.for_reports('estimator', 10)
    before = count()
    probe.for_reports('estimator', 5)
    assert count() == before
    assert ['channels-wrong'] in doubts and not doubts[-1]
    assert estimator.end() == 0, estimator.text
