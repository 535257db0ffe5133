"""Simulator to estimator and recorder over DDS: nothing lost, and a replay equal to the bit."""

import os
import signal
from pathlib import Path

import numpy as np
import pytest
from actuator_glue_msgs.msg import PosteriorMoments
from actuator_glue_msgs.srv import SetModel
from ros_nodes import QUICK, RATE, recorded

from actuator_glue.inference.choice import choose_model
from actuator_glue.io.bag_reader import decoded, summarise
from actuator_glue.nodes import topics
from actuator_glue.nodes.diagnoser_worker import requested
from actuator_glue.online.job import WindowResult
from actuator_glue.online.playback import items, replay
from actuator_glue.online.replay_comparison import compare, published
from actuator_glue.online.structures import Proposal, Proposed
from actuator_glue.records import Record

ROOT = Path(__file__).resolve().parents[2]
INPUTS = ('SampleBlock', 'TestSetup')
RESULTS = ('EstimatorSetup', 'PosteriorMoments', 'PredictionBand')


def begin(start, probe, bag, **settings):
    """Start recorder and estimator and wait until the estimator has compiled."""
    recorder = start('recorder', bag=str(bag))
    estimator = start('estimator', **settings)
    probe.until(lambda: probe.value('estimator', 'worker') == 'ready', 250, 'estimator compiled')
    probe.until(lambda: probe.value('recorder', 'state') == 'active')
    return recorder, estimator


def finish(probe, recorder, estimator, samples):
    """Wait until everything sent has been estimated; end both; nothing died."""
    probe.until(lambda: probe.number('estimator', 'samples') >= samples, what='samples')
    probe.for_a_while(2.5)
    assert estimator.end() == 0, estimator.text
    assert recorder.end(signal.SIGTERM) == 0, recorder.text


def replayed(bag):
    """Comparison of a replay with what was published live, and the live results."""
    (live,) = published(decoded(bag, RESULTS))
    again = replay(items(decoded(bag, INPUTS)), live.settings, live.models[0][1], live.schedule())
    return compare([r for r in again if isinstance(r, WindowResult)], live), live


def one_kilohertz(start, probe, tmp_path, seconds):
    """The 1 kHz chain; returns the bag and what was lost or late."""
    bag = tmp_path / 'bag'
    recorder, estimator = begin(start, probe, bag)
    simulator = start(
        'actuator_sim', duration=seconds, rest=0.0, wait_for=2, preview=2.0, exit_at_end=True
    )
    assert simulator.wait(seconds + 40) == 0, simulator.text
    samples = round(1000 * seconds) + 1
    finish(probe, recorder, estimator, samples)
    assert np.array_equal(recorded(bag), np.arange(samples))
    assert probe.number('estimator', 'samples') == samples
    assert probe.number('estimator', 'samples lost') == 0
    comparison, live = replayed(bag)
    assert comparison.identical, comparison.differing
    assert comparison.windows == len(live.posteriors)
    return live


@pytest.mark.slow
def test_one_kilohertz_for_ten_seconds(start, probe, tmp_path):
    live = one_kilohertz(start, probe, tmp_path, 10.0)
    # Whether each window is in time is judged on a computer that has nothing else to do.
    assert len(live.posteriors) >= 3
    early = [m for m in live.scored.values() if m.kind == 'total']
    assert all(m.forecast for m in early)


@pytest.mark.slow
def test_one_kilohertz_for_a_minute_misses_no_deadline(start, probe, tmp_path):
    live = one_kilohertz(start, probe, tmp_path, 60.0)
    assert len(live.posteriors) == 56
    assert probe.number('estimator', 'deadlines missed') == 0
    coverage = [m.widest_coverage for m in live.scored.values() if m.kind == 'total']
    # 54 bands of 1000 samples: the standard error of their mean is 0.1 %.
    assert 0.94 < np.mean(coverage) < 0.96


@pytest.mark.slow
def test_the_model_changes_live_and_the_replay_repeats_it(start, probe, tmp_path):
    bag, told = tmp_path / 'bag', list[PosteriorMoments]()
    probe.create_subscription(PosteriorMoments, 'posterior', told.append, topics.POSTERIOR.qos)
    recorder, estimator = begin(start, probe, bag, **QUICK)
    simulator = start(
        'actuator_sim',
        rate=RATE,
        duration=120.0,
        command='noise',
        frequency_end=8.0,
        wait_for=2,
        undeclared_effect='delay:delay=0.004',
        sealed_file=str(tmp_path / 'truth.json'),
    )
    probe.until(lambda: probe.number('estimator', 'windows') >= 3, what='windows')
    refused = probe.call(SetModel, 'estimator/set_model', SetModel.Request(effects=['nothing']))
    assert not refused.success and 'not in the catalogue' in refused.message
    refused = probe.call(
        SetModel, 'estimator/set_model', SetModel.Request(parameter_names=['beta_1'])
    )
    assert not refused.success and 'do not belong together' in refused.message
    taken = probe.call(
        SetModel,
        'estimator/set_model',
        SetModel.Request(
            effects=['delay'],
            parameter_names=['delay'],
            lower=[0.0],
            upper=[0.02],
            start=[0.005],
        ),
    )
    assert taken.success, taken.message
    probe.until(lambda: probe.value('estimator', 'model') == 'delay')
    # Beside it another, which a process of its own samples whenever it can.
    names = ('delay',), ('bias',)
    two = Proposal(
        tuple(Proposed(choose_model(n), w) for n, w in zip(names, (0.9, 0.1), strict=True))
    )
    assert probe.call(SetModel, 'estimator/set_model', requested(two)).success
    # That process starts while others want the same cores: the stream lasts until it has answered.
    probe.until(
        lambda: any(sum(list(m.structure_evaluations)[1:]) for m in told),
        100,
        'the second structure was sampled',
    )
    assert simulator.end() == 0, simulator.text
    finish(probe, recorder, estimator, 1)
    comparison, live = replayed(bag)
    assert comparison.identical, comparison.differing
    models = {tuple(m.effects) for m in live.posteriors.values()}
    assert models == {(), ('delay',)}
    spent = [sum(list(m.structure_evaluations)[1:]) for m in live.posteriors.values()]
    assert any(spent)
    last = live.posteriors[max(live.posteriors)]
    assert list(last.parameter_names)[-1] == 'delay' and last.units[-1] == 's'
    assert last.mean[-1] == pytest.approx(0.004, abs=max(5 * last.stddev[-1], 5e-4))


def test_a_file_is_streamed_and_replayed_faster_than_real_time(start, probe, tmp_path):
    """lab_bridge, then the replay node on the bag: the same samples twice, and what they are."""
    rng = np.random.default_rng(0)
    time = np.arange(1200) / RATE
    command = np.sin(2 * np.pi * 1.5 * time)
    rows = np.column_stack([time, command, 0.9 * command + 0.01 * rng.standard_normal(1200)])
    file = tmp_path / 'test.csv'
    np.savetxt(file, rows, delimiter=',', header='time_s,command_deg,measured_deg', comments='')
    bags = tmp_path / 'first', tmp_path / 'second'
    recorder = start('recorder', bag=str(bags[0]))
    bridge = start(
        'lab_bridge', file=str(file), specimen_stiffness=0.0, speed=5.0, wait_for=1, preview=1.0
    )
    assert bridge.wait(60) == 0, bridge.text
    assert recorder.end() == 0
    second = start('recorder', name='recorder_2', bag=str(bags[1]))
    player = start('replay', bag=str(bags[0]), speed=5.0, wait_for=1)
    assert player.wait(60) == 0, player.text
    assert second.end() == 0
    for bag in bags:
        assert np.array_equal(recorded(bag), np.arange(1200))
    first, again = (list(decoded(bag, ('SampleBlock',))) for bag in bags)
    for (_, one), (_, other) in zip(first, again, strict=True):
        assert np.array_equal(one.measured, other.measured)
        assert one.header.stamp == other.header.stamp
    (setup,) = [m for _, m in decoded(bags[1], ('TestSetup',))]
    assert (setup.specimen_stiffness, setup.motion) == (0.0, 'deg')
    assert setup.rate == pytest.approx(RATE)


@pytest.mark.slow
def test_a_recorder_that_stalls_keeps_the_set_up_before_its_samples(start, probe, tmp_path):
    """What waits on two topics at once is recorded in the order a replay needs."""
    bag = tmp_path / 'bag'
    recorder, estimator = begin(start, probe, bag, **QUICK)
    probe.open_stream(listeners=2)
    recorder.process.send_signal(signal.SIGSTOP)
    probe.setup()
    time = np.arange(800) / RATE
    command = 2e-3 * np.sin(2 * np.pi * 1.5 * time)
    measured = np.roll(command, 4) + 1e-5 * np.random.default_rng(1).standard_normal(800)
    probe.stream(Record(command, measured, 1.0 / RATE))
    recorder.process.send_signal(signal.SIGCONT)
    finish(probe, recorder, estimator, 800)
    comparison, _ = replayed(bag)
    assert comparison.identical, comparison.differing


def test_an_undeclared_effect_is_told_to_nobody_but_the_sealed_file(start, probe, tmp_path):
    import json

    bag, sealed = tmp_path / 'bag', tmp_path / 'truth.json'
    recorder = start('recorder', bag=str(bag), topics=['/parameter_events', '/rosout'])
    simulator = start(
        'actuator_sim',
        rate=RATE,
        duration=4.0,
        wait_for=1,
        exit_at_end=False,
        undeclared_effect='backlash:backlash=6.25e-5',
        sealed_file=str(sealed),
    )
    probe.until(lambda: probe.number('actuator_sim', 'samples') > 100)
    (hidden,) = probe.get('actuator_sim', ['undeclared_effect'])
    assert 'backlash' not in hidden.string_value
    truth = json.loads(sealed.read_text())
    assert truth['effects'] == {'backlash': {'backlash': 6.25e-5}}
    assert sealed.stat().st_mode & 0o077 == 0
    # Changed while running: still told to nobody.
    (refused,) = probe.set('actuator_sim', undeclared_effect='wobble')
    assert not refused.successful
    (taken,) = probe.set('actuator_sim', undeclared_effect='specimen-gap')
    assert taken.successful
    (hidden,) = probe.get('actuator_sim', ['undeclared_effect'])
    assert 'gap' not in hidden.string_value
    probe.until(lambda: 'specimen-gap' in sealed.read_text())
    probe.for_a_while(1.0)
    assert simulator.end() == 0 and recorder.end() == 0
    content = b''.join(p.read_bytes() for p in bag.iterdir())
    for word in (b'backlash', b'specimen-gap'):
        assert word not in content
    assert '/parameter_events' in summarise(bag).topics


@pytest.mark.slow
def test_the_measured_record_streams_through_the_suite(start, probe, tmp_path):
    """A real servo-hydraulic machine, four times faster than it was measured."""
    folder = Path(os.environ.get('ACTUATOR_GLUE_MTS', ROOT.parent / 'shared/data/mts'))
    file = folder / 'mts_2022-05-25_chirp15Hz_MR0A.txt'
    if not file.exists():
        pytest.skip(f'the measured records are not at {folder}; set ACTUATOR_GLUE_MTS')
    bag = tmp_path / 'bag'
    recorder, estimator = begin(start, probe, bag)
    bridge = start(
        'lab_bridge',
        file=str(file),
        channels=str(ROOT / 'config/channels/mts.yaml'),
        specimen_stiffness=0.0,
        speed=4.0,
        wait_for=2,
        preview=2.0,
        block=20,
    )
    assert bridge.wait(90) == 0, bridge.text
    finish(probe, recorder, estimator, 46_800)
    assert np.array_equal(recorded(bag), np.arange(46_800))
    comparison, live = replayed(bag)
    assert comparison.identical, comparison.differing
    assert comparison.windows >= 5 and comparison.bands >= 6
    # Fits of the whole record outside this project: 15 Hz, 27 um rms; windows of 5 s, of a
    # narrow band each, leave less. The sensor's noise is 3 um.
    found = list(live.posteriors.values())
    natural = np.median([np.sqrt(m.best[1] / m.best[2]) / (2 * np.pi) for m in found])
    assert 10.0 < natural < 20.0
    assert 6e-6 < np.median([m.rms_error for m in found]) < 3e-5
    # The machine has effects that Eq. (2) lacks: the noise band must break.
    noise = [m.widest_coverage for m in live.scored.values() if m.kind == 'noise']
    assert np.mean(noise) < 0.6
