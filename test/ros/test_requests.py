"""Requests of other models that the estimator refuses, and why."""

import pytest
from actuator_glue_msgs.msg import ModelProposal
from actuator_glue_msgs.srv import SetModel

from actuator_glue.errors import InputError
from actuator_glue.nodes.configuration import requested

TWICE = {'parameter_names': ['delay', 'delay'], 'lower': [0.0, 0.0], 'upper': [0.02, 0.01]}


def test_a_parameter_is_bounded_once() -> None:
    """In a request as in each of its structures: which bounds are meant would be a guess."""
    match = 'parameter_names holds delay more than once'
    with pytest.raises(InputError, match=match):
        requested(SetModel.Request(effects=['delay'], **TWICE))
    with pytest.raises(InputError, match=match):
        requested(SetModel.Request(structures=[ModelProposal(effects=['delay'], **TWICE)]))


def test_a_parameter_is_known_once() -> None:
    one = ModelProposal(weight=1.0, known_names=['beta_1', 'beta_1'], known=[100.0] * 200)
    with pytest.raises(InputError, match='known_names holds beta_1 more than once'):
        requested(SetModel.Request(structures=[one]))
