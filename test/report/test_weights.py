"""Explanations and their weights over time, as a table."""

import re
from pathlib import Path
from types import SimpleNamespace as Message

import pytest

from actuator_glue.errors import InputError
from actuator_glue.online import conversion
from actuator_glue.online.stream import structure_weights
from actuator_glue.report import weights
from actuator_glue.report.weights import Spell, spells

SESSION = Path(__file__).resolve().parents[2] / 'bags' / 'session'


def test_a_spell_ends_where_others_are_carried_or_another_one_leads() -> None:
    course = [
        (5.0, {'Eq. (2)': 1.0}),
        (6.0, {'Eq. (2)': 1.0}),
        (7.0, {'Eq. (2)': 0.62, 'backlash': 0.38}),
        (8.0, {'Eq. (2)': 0.51, 'backlash': 0.49}),
        (9.0, {'backlash': 0.7, 'Eq. (2)': 0.3}),
        (30.0, {'Eq. (2)': 0.012, 'backlash': 0.988}),
    ]
    found = spells(course)
    assert [(s.start_s, s.stop_s, s.told()) for s in found] == [
        (5.0, 6.0, 'Eq. (2) 100 %'),
        (7.0, 8.0, 'Eq. (2) 62 -> 51 %, backlash 38 -> 49 %'),
        (9.0, 30.0, 'backlash 70 -> 99 %, Eq. (2) 30 -> 1 %'),
    ]
    assert weights.rows(found)[2][:2] == ('9.0', '30.0')
    assert spells([]) == []


def test_only_the_last_are_shown() -> None:
    course = [(float(i), {f'effect-{i % 2}': 1.0}) for i in range(100)]
    assert len(weights.rows(spells(course))) == weights.ROWS
    assert weights.rows(spells(course))[-1] == ('99.0', '99.0', 'effect-1 100 %')


def test_what_a_bag_carried() -> None:
    """A session of an older version: Eq. (2) first, play in its place at 26 s."""
    (course,) = weights.of_bag(SESSION.with_name('older_session')).values()
    first, second = spells(course)
    assert first == Spell(first.start_s, first.stop_s, {'Eq. (2)': 1.0}, {'Eq. (2)': 1.0})
    assert (first.start_s, second.told()) == (pytest.approx(5.0), 'backlash 100 %')
    assert first.stop_s < second.start_s < 30.0 and second.stop_s == pytest.approx(41.0)


def test_weights_move_over_the_reference_session() -> None:
    """Play comes in beside Eq. (2), which leaves within three windows."""
    (course,) = weights.of_bag(SESSION).values()
    first, *between, last = [s.told() for s in spells(course)]
    assert (first, last) == ('Eq. (2) 100 %', 'backlash 100 %')
    assert len(between) == 1 and re.fullmatch(r'backlash 9\d %, Eq\. \(2\) \d %', between[0])


@pytest.mark.parametrize('shares', [[0.6], [0.5, 0.3, 0.2]])
def test_weights_that_do_not_belong_to_the_structures_are_refused(shares: list[float]) -> None:
    """Whose weight it is would be a guess; one structure of old is not asked for any."""
    message = Message(structures=['Eq. (2)', 'backlash'], weights=shares, window=7)
    with pytest.raises(InputError, match=f'window 7: {len(shares)} weights of 2 structures'):
        structure_weights(message)
    with pytest.raises(InputError, match='weights of 2 structures'):
        conversion.weights(message)
    assert structure_weights(Message(effects=['play'])) == [('play', 1.0)]
