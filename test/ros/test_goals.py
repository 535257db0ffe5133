"""Goals of the diagnoser: each ends with its own outcome, whatever else comes meanwhile."""

from types import SimpleNamespace

import pytest
from actuator_glue_msgs.action import Diagnose
from rclpy.task import Future

from actuator_glue.inference.choice import choose_model
from actuator_glue.nodes import diagnoser, diagnoser_worker
from actuator_glue.online.structures import Proposal
from actuator_glue.online.when_to_diagnose import Concluded, Requested
from actuator_glue.workers.worker import DONE, Answer


class Goal:
    """What the action server hands over, without a client."""

    def __init__(self):
        self.request = Diagnose.Goal(records=['bag'])
        self.is_cancel_requested = False
        self.result = None

    def execute(self, end):
        assert self.result is None
        self.result = end(self)

    def succeed(self):
        self.state = 'succeeded'

    def abort(self):
        self.state = 'aborted'


@pytest.fixture
def node(probe, monkeypatch):
    """An active diagnoser in this process that computes nothing, beside an estimator."""
    monkeypatch.setattr(diagnoser_worker, 'fields', lambda outcome: {})
    made = diagnoser.DiagnoserNode()
    made.trigger_configure()
    made.trigger_activate()
    made.worker.submit = lambda *_: None
    made._explained = SimpleNamespace(diagnosis=lambda _: None, values=dict)
    asked = made.asked = []

    def ask(_):
        asked.append(Future())
        return asked[-1]

    made._model_client = SimpleNamespace(
        service_is_ready=lambda: True, call_async=ask, srv_name='set_model'
    )
    yield made
    made.trigger_shutdown()
    made.destroy_node()


def outcome(message, carried):
    """An outcome that has the estimator carry backlash, or leaves it as it is."""
    play = Proposal.of(choose_model(('backlash',))) if carried else None
    found = SimpleNamespace(to_json=dict)
    return diagnoser_worker.Outcome(found, message, concluded=Concluded(play, apply=True))


def test_a_goal_ends_with_its_own_outcome(node):
    """It ended with that of the look before, for which the estimator was yet to answer."""
    node._take(Requested())
    node._start(diagnoser_worker.Request())
    node.answered(Answer(DONE, outcome('a look of its own', carried=True), 1.0))
    goal = Goal()
    node._accepted(goal)
    node.asked[0].set_result(SimpleNamespace(success=True, message=''))
    assert goal.result is None
    node.answered(Answer(DONE, outcome('what was asked for', carried=False), 1.0))
    assert goal.state == 'succeeded' and goal.result.message == 'what was asked for'
    assert not goal.result.applied


def test_a_goal_does_not_outlive_the_node_s_activity(node):
    """Nobody gave up waiting for the estimator's answer any more, and no goal was taken."""
    goal = Goal()
    node._accepted(goal)
    node.answered(Answer(DONE, outcome('asked for', carried=True), 1.0))
    assert goal.result is None
    node.trigger_deactivate()
    assert goal.result.message == 'asked for' and not goal.result.applied
