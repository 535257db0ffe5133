"""Requests of other models that the estimator refuses, and why."""

import numpy as np
import pytest
from actuator_glue_msgs.msg import ModelProposal
from actuator_glue_msgs.srv import SetModel

from actuator_glue.errors import InputError
from actuator_glue.inference.carried import Carried
from actuator_glue.inference.choice import choose_model
from actuator_glue.model.parameters import NAMES
from actuator_glue.nodes.configuration import requested
from actuator_glue.nodes.diagnoser_worker import requested as asked
from actuator_glue.online.knowledge import Known
from actuator_glue.online.structures import Proposal, Proposed

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


@pytest.mark.parametrize('material', [1e300, 1e-300, -1.0, float('inf'), 3.0, 1e-10])
def test_an_error_that_no_test_has_is_not_what_matters(material) -> None:
    """Its square would be no number, and no window after it would have a posterior."""
    two = [ModelProposal(weight=0.5), ModelProposal(effects=['delay'], weight=0.5)]
    with pytest.raises(InputError, match=r'material .* is outside \[1e-09, 2\] m'):
        requested(SetModel.Request(structures=two, material=material))
    assert requested(SetModel.Request(structures=two, material=1e-6)).material == 1e-6
    assert np.isnan(requested(SetModel.Request(structures=two)).material)


THETA = np.array([134.0, 1.1e9, 2.5e5, 0.5])
SPREAD = THETA * (1.0 + 0.02 * np.random.default_rng(1).standard_normal((400, 4)))


@pytest.mark.parametrize('constant', [(0, 1, 2, 3), (1, 2, 3), (3,)])
def test_draws_without_spread_are_no_knowledge(constant) -> None:
    draws = SPREAD.copy()
    draws[:, constant] = THETA[list(constant)]
    with pytest.raises(InputError, match=f'{NAMES[constant[-1]]} are all the same'):
        requested(known(draws))
    draws[:3] = 10.0 * THETA  # outside of the bounds, and left out
    with pytest.raises(InputError, match='are all the same'):
        requested(known(draws))
    assert requested(known(SPREAD)).structures[0].known is not None


def known(draws):
    one = ModelProposal(weight=1.0, known_names=list(NAMES), known=draws.ravel().tolist())
    return SetModel.Request(structures=[one])


def test_what_a_diagnoser_asks_for_is_never_refused_for_that() -> None:
    """Draws that ended at a bound are left out; a record without noise has no material error."""
    draws = SPREAD.copy()
    draws[:, 3] = 0.5
    one = Proposed(choose_model(), 1.0, Known(Carried(NAMES, draws), 5, 9))
    (back,) = requested(asked(Proposal((one,), 1e-30))).structures
    assert back.known.carried.names == NAMES[:3]
    assert np.array_equal(back.known.carried.draws, draws[:, :3])
