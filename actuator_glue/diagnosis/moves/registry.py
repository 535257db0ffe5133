"""All moves, in the order in which they are tried.

A search that adds one effect at a time ends with an answer (beam_search.py). Answers that it
cannot reach are tried here: another scope, another form, other names for everything. The first
move that is taken ends its group.
"""

from __future__ import annotations

from typing import Final

from actuator_glue.diagnosis.moves import (
    feedback,
    learned_terms,
    other_hold,
    own_setting,
    reserved,
    since_onset,
    that_matter,
    two_effects,
    two_for_one,
)
from actuator_glue.diagnosis.moves.move import (
    AnswerMove,
    Groups,
    always,
    complete,
    described,
    if_complete,
    unexplained,
)

# Moves under one hold and one onset.
WITHIN: Final[Groups] = (
    (
        AnswerMove("one record's own setting", described, own_setting.own_setting),
        AnswerMove('learned terms', described, learned_terms.with_terms),
    ),
    (
        AnswerMove('', always, feedback.fed_back),
        AnswerMove(
            'a description in place of names', complete, learned_terms.plainer, each_time=False
        ),
    ),
    (AnswerMove('effects reserved for the rest', unexplained, reserved.with_reserved),),
    (AnswerMove("one record's own setting", unexplained, own_setting.own_setting),),
)
# Moves across holds and onsets. Effects that always act come before those that start mid-record.
ACROSS: Final[Groups] = (
    (AnswerMove('', always, other_hold.with_the_right_hold),),
    (AnswerMove('', always, since_onset.since_onset),),
    (
        AnswerMove(
            'two effects at once', unexplained, if_complete(two_effects.explained, apart=True)
        ),
    ),
    (AnswerMove('effects that matter after all', complete, if_complete(that_matter.that_matter)),),
    (AnswerMove('two effects for one', complete, if_complete(two_for_one.exchanged)),),
)
