"""What nobody filled in a message is not known, never zero."""

import math

import actuator_glue_msgs.msg as msg
import pytest
from actuator_glue_msgs.action import Diagnose

from actuator_glue.diagnosis.estimate import Estimate
from actuator_glue.diagnosis.finding import Finding
from actuator_glue.io.messages import definition_folder
from actuator_glue.nodes import diagnoser_worker
from actuator_glue.nodes.messages import fill
from actuator_glue.online.conversion import Head
from actuator_glue.setups import from_message

NAMES = sorted(p.stem for p in definition_folder().glob('*.msg') if 'header' in p.read_text())


@pytest.mark.parametrize(('given', 'known'), [({}, None), ({'specimen_stiffness': 0.0}, 0.0)])
def test_a_set_up_without_a_stiffness_is_no_free_actuator(given, known):
    message = msg.TestSetup(actuator='rig', rate=200.0, hold='zoh', **given)
    assert from_message(message).stiffness == known


@pytest.mark.parametrize(
    ('given', 'known'),
    [
        ({}, None),
        ({'holdout_stiffness': math.nan}, None),
        ({'holdout_stiffness': 0.0}, 0.0),
        ({'holdout_stiffness': 3e5}, 3e5),
    ],
)
def test_a_goal_without_a_stiffness_has_the_held_out_record_say_it(given, known):
    goal = Diagnose.Goal(records=['a', 'b'], holdout='c', **given)
    request = diagnoser_worker.asked(goal, ())
    assert request.holdout_stiffness == known


@pytest.mark.parametrize('name', NAMES)
def test_real_numbers_that_a_node_does_not_give_are_nan(name):
    kind = getattr(msg, name)
    message = fill(kind(), Head(5_000_000_007, 'rig'), {})
    assert (message.header.stamp.sec, message.header.frame_id) == (5, 'rig')
    fields = kind.get_fields_and_field_types().items()
    numbers = [field for field, kind in fields if kind == 'double']
    assert all(math.isnan(getattr(message, field)) for field in numbers)


def test_an_answer_without_a_diagnosis_has_no_errors_of_zero():
    outcome = diagnoser_worker.Outcome(message='no')
    message = diagnoser_worker.fill_message(msg.Diagnosis(), Head(0, ''), outcome)
    assert math.isnan(message.error_after) and math.isnan(message.noise_floor)


def test_an_effect_comes_with_its_limits_and_says_what_is_fixed():
    sizes = {
        'delay': Estimate(4e-3, 1e-5, 3.98e-3, 4.02e-3, 's', 0.0),
        'lag': Estimate(0.5, 0.29, 0.025, 0.975, '1', 0.0, identified=False),
    }
    found = Finding('delay', ('valve',), 0.9, 'command', sizes, 2e-5, 1e-5, 30.0)
    message = diagnoser_worker.effect_message(found)
    assert isinstance(message, msg.Effect)
    assert list(message.parameter_names) == ['delay', 'lag']
    assert list(message.mean) == [4e-3, 0.5] and list(message.stddev) == [1e-5, 0.29]
    assert list(message.lower) == [3.98e-3, 0.025] and list(message.upper) == [4.02e-3, 0.975]
    assert list(message.identified) == [True, False]
