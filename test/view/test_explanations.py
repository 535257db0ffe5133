"""What a diagnosis says, for the page."""

from types import SimpleNamespace as Message

import pytest
from stream import diagnosis, posterior

from actuator_glue.errors import InputError
from actuator_glue.view.explanations import diagnosed, explanations
from actuator_glue.view.history import History
from actuator_glue.view.intake import Intake


def test_tied_names_have_probabilities_and_sizes_if_true() -> None:
    """The told one with its limits; the other what it is in its place, Eq. (2)'s own left out."""
    found = diagnosed(diagnosis())
    (play,) = found['effects']
    (friction,) = play['tied']
    assert (play['probability'], friction['probability']) == (0.6, 0.37)
    (size,) = play['sizes']
    assert (size['mean'], size['unit']) == (pytest.approx(41.0), 'um')
    assert size['limits'] == pytest.approx([40.2, 41.9])
    (force,) = friction['sizes']
    assert (force['name'], force['mean'], force['unit']) == ('coulomb_force', 812.0, 'N')


def test_the_next_experiment_in_words() -> None:
    (text,) = diagnosed(diagnosis())['experiments']
    assert text.startswith('a slow triangle wave (0.1 Hz) of 0.5 mm without specimen, 30 s')
    assert '41 nats' in text


@pytest.mark.parametrize('text', ['', '{', '[]', '{"experiments": [{}], "effects": 3}'])
def test_a_diagnosis_whose_json_cannot_be_read_still_has_its_names(text: str) -> None:
    message = diagnosis()
    message.json = text
    found = diagnosed(message)
    assert found['summary'] == 'missing: backlash' and found['experiments'] == []
    assert [(e['name'], e['sizes']) for e in found['effects']] == [('backlash', [])]


def test_structures_are_the_likeliest_first_with_their_own_parameters() -> None:
    """One that a window left no time for has none; odd sizes do no harm."""
    message = posterior(3, 100.0, Eq2=0.2, backlash__gain_drift=0.8)
    message.structure_sizes = [0, 2]
    message.structure_parameter_names = ['beta_1', 'backlash']
    first, second = explanations(message)
    assert (first.name, first.weight) == ('backlash + gain-drift', 0.8)
    assert [p['name'] for p in first.parameters] == ['beta_1', 'backlash']
    assert second.parameters == ()
    bare = Message(effects=['play'])
    assert [one.name for one in explanations(bare)] == ['play']


def test_a_posterior_without_all_its_weights_is_refused_and_those_after_it_are_shown() -> None:
    """One clear reason; nothing of it is on the page, and the page goes on."""
    intake = Intake(History(100), 'live', live=True)
    bad = posterior(3, 100.0, Eq2=0.2, backlash=0.8)
    bad.weights = [1.0]
    with pytest.raises(InputError, match='window 3: 1 weights of 2 structures'):
        intake.take('PosteriorMoments', bad)
    intake.take('PosteriorMoments', posterior(4, 100.0, Eq2=0.2, backlash=0.8))
    assert [one.name for one in explanations(posterior(5, Eq2=1.0))] == ['Eq. (2)']
    assert 'backlash' in intake._explained
