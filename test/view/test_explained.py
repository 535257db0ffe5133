"""What the diagnoser shows of explanations on /diagnostics."""

import json

from stream import diagnosis, posterior

from actuator_glue.nodes.explained import Explained


def test_which_how_sure_since_when_and_the_sizes_if_true() -> None:
    made = Explained()
    assert set(made.values().values()) == {'not known yet'}
    made.posterior(posterior(4, 120.0, Eq2=1.0))
    made.posterior(posterior(9, 120.0, Eq2=0.7, backlash=0.3))
    made.posterior(posterior(10, 134.0, Eq2=0.04, backlash=0.96))
    told = made.values()
    assert told['explanations'] == 'backlash 96 % (since 10.0 s), Eq. (2) 4 % (since 5.0 s)'
    assert told['parameters if true'] == (
        'backlash: beta_1 135 +- 2.5 1/s, backlash 41 +- 1 um; '
        'Eq. (2): beta_1 134 +- 2.5 1/s, backlash 40 +- 1 um'
    )
    # What left and comes back, and what a stream that began anew carries, is new.
    made.posterior(posterior(11, 134.0, backlash=1.0))
    made.posterior(posterior(12, 134.0, Eq2=0.1, backlash=0.9))
    assert 'Eq. (2) 10 % (since 13.0 s)' in made.values()['explanations']
    made.posterior(posterior(0, 134.0, backlash=1.0))
    assert made.values()['explanations'] == 'backlash 100 % (since 1.0 s)'


def test_the_next_experiment_stands_until_another_diagnosis() -> None:
    made = Explained()
    made.diagnosis(json.loads(diagnosis().json))
    assert made.values()['next experiment'].startswith('a slow triangle wave (0.1 Hz) of 0.5 mm')
    made.diagnosis({'experiments': []})
    assert made.values()['next experiment'] == 'none: no names are tied'
