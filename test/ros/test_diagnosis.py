"""The loop closed live: alarm, diagnosis, augmented model, error before and after."""

import json
import signal
from pathlib import Path

import numpy as np
import pytest
from actuator_glue_msgs.action import Diagnose
from actuator_glue_msgs.msg import Diagnosis
from rclpy.action import ActionClient
from rclpy.qos import DurabilityPolicy, QoSProfile

from actuator_glue.diagnosis.telling.result import SCHEMA
from actuator_glue.io.bag_reader import decoded
from actuator_glue.model.parameters import NAMES
from examples.demonstration import pretests

TRUTH = np.array([134.0, 1.1e9, 2.5e5, 0.5])
BAGS = Path(__file__).resolve().parents[2] / 'bags'


@pytest.mark.slow
def test_an_undeclared_effect_is_found_and_the_model_goes_on_with_it(start, probe, tmp_path):
    """The whole loop in one run, as two short tests tell of it; judged from the bag alone."""
    bag, sealed = tmp_path / 'bag', tmp_path / 'truth.json'
    path = pretests.calibrate(TRUTH, 250e3, 250.0, 1, tmp_path / 'known.npz', lambda _: None)
    recorder = start('recorder', bag=str(bag))
    estimator = start('estimator', prior='sequential', calibration=str(path))
    diagnoser = start('diagnoser', apply=True, minimum=25.0)
    probe.until(lambda: probe.value('estimator', 'worker') == 'ready', 250, 'estimator compiled')
    probe.until(lambda: probe.value('diagnoser', 'state') == 'active')
    simulator = start(
        'actuator_sim',
        rate=250.0,
        duration=90.0,
        wait_for=3,
        exit_at_end=True,
        undeclared_effect='backlash:backlash=6e-5',
        sealed_file=str(sealed),
        specimen_stiffness=250e3,
        **dict(zip(NAMES, TRUTH.tolist(), strict=True)),
    )
    assert simulator.wait(180) == 0, simulator.text
    probe.for_a_while(2.0)
    for node in (estimator, diagnoser):
        assert node.end() == 0, node.text
    assert recorder.end(signal.SIGTERM) == 0

    (found,) = [m for _, m in decoded(bag, ('Diagnosis',))][:1]
    assert found.verdict == found.MISSING_EFFECT
    named = {found.effects[0].name, *found.effects[0].alternatives}
    assert next(iter(json.loads(sealed.read_text())['effects'])) in named
    assert found.error_after < found.error_before
    assert 'covers' in found.reason
    prior = json.loads(found.json)['prior']
    assert prior['source'] == 'the estimator', 'the diagnosis began with nothing'
    assert json.loads(found.json)['schema'] == SCHEMA
    moments = [m for _, m in decoded(bag, ('PosteriorMoments',))]
    assert any(m.effects for m in moments), 'the estimator did not go on with the effect'
    assert all(len(m.mean) > 4 for m in moments if m.effects)
    swapped = next(m.window for m in moments if m.effects)
    last = moments[-1]
    assert last.structures[0] == 'backlash' and last.weights[0] == max(last.weights) > 0.5
    # Sizes were handed back: the first window with the effect knows it already.
    first = next(m for m in moments if m.effects)
    assert first.stddev[4] < 0.05 * first.mean[4]
    inside = [
        abs(m.mean[j] - TRUTH[j]) <= 1.96 * m.stddev[j]
        for m in moments
        if m.window >= swapped
        for j in range(4)
    ]
    assert np.mean(inside) >= 0.9
    bands = [m for _, m in decoded(bag, ('PredictionBand',)) if m.scored and m.kind == m.NOISE]
    before = [m for m in bands if m.window < swapped]
    # The first windows after the change start from the prior of the effect.
    after = [m for m in bands if m.window >= swapped + 3]
    assert len(before) >= 10 and len(after) >= 10
    assert np.mean([m.rms_error for m in after]) < 0.8 * np.mean([m.rms_error for m in before])
    assert np.mean([m.widest_coverage for m in before]) < 0.8
    assert np.mean([m.widest_coverage for m in after]) > 0.9


@pytest.mark.slow
def test_a_diagnosis_on_request_reports_its_progress_and_can_be_cancelled(start, probe):
    diagnoser = start('diagnoser')
    client = ActionClient(probe, Diagnose, 'diagnoser/diagnose')
    probe.until(client.server_is_ready)
    told, diagnoses = [], []
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    probe.create_subscription(Diagnosis, 'diagnosis', diagnoses.append, latched)

    def ask(**goal):
        sent = client.send_goal_async(
            Diagnose.Goal(**goal), feedback_callback=lambda m: told.append(m.feedback)
        )
        probe.until(sent.done)
        return sent.result()

    def result(handle):
        future = handle.get_result_async()
        probe.until(future.done, 250, 'result')
        return future.result().result

    unusable = result(ask(records=['no-such-bag']))
    assert not unusable.success and 'no-such-bag' in unusable.message
    nothing = result(ask())
    assert not nothing.success and 'no stretch of 5 s' in nothing.message

    goal = {'records': [str(BAGS / 'undeclared_clamped')], 'seed': 3}
    handle = ask(**goal)
    assert handle.accepted and not ask(**goal).accepted  # one at a time
    probe.until(lambda: told, 250, 'feedback')
    cancelled = handle.cancel_goal_async()
    probe.until(cancelled.done)
    assert not result(handle).success

    told.clear()
    answer = result(ask(**goal))
    assert answer.success, answer.message
    assert told and all(0.0 <= f.fraction <= 1.0 and f.stage for f in told)
    fractions = [f.fraction for f in told]
    assert fractions == sorted(fractions) and fractions[-1] == 1.0
    probe.until(lambda: diagnoses)
    assert diagnoses[0].verdict == answer.diagnosis.verdict
    assert diagnoser.end() == 0


def test_a_diagnosis_that_is_given_up_is_told(start, probe):
    """As when a launch ends while it runs: the log says so, and what to do."""
    diagnoser = start('diagnoser')
    client = ActionClient(probe, Diagnose, 'diagnoser/diagnose')
    probe.until(client.server_is_ready)
    sent = client.send_goal_async(Diagnose.Goal(records=[str(BAGS / 'undeclared_clamped')]))
    probe.until(sent.done)
    probe.until(lambda: probe.value('diagnoser', 'diagnosing') == 'True')
    assert diagnoser.end() == 0
    assert 'given up after' in diagnoser.text and 'linger' in diagnoser.text
