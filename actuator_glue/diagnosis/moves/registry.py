"""All moves, in the order in which they are asked for.

A search that adds one effect at a time ends with an answer (beam_search.py). What it cannot
reach by that is asked for here: another scope, another form, other names for all of it. Of a group
the first move that is taken ends it.
"""

from __future__ import annotations

from typing import Final

from actuator_glue.diagnosis.moves import (
    describe,
    feedback,
    other_hold,
    own_setting,
    reserved,
    since_onset,
    that_matter,
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

# With one hold, since one moment.
WITHIN: Final[Groups] = (
    (
        AnswerMove("one record's own setting", described, own_setting.own_setting),
        AnswerMove('learned terms', described, describe.with_terms),
    ),
    (
        AnswerMove('', always, feedback.fed_back),
        AnswerMove('a description in place of names', complete, describe.plainer, each_time=False),
    ),
    (AnswerMove('effects reserved for the rest', unexplained, reserved.with_reserved),),
    (AnswerMove("one record's own setting", unexplained, own_setting.own_setting),),
)
# What acts all the time comes before what appears.
ACROSS: Final[Groups] = (
    (AnswerMove('', always, other_hold.with_the_right_hold),),
    (AnswerMove('', always, since_onset.since_onset),),
    (AnswerMove('effects that matter after all', complete, if_complete(that_matter.that_matter)),),
    (AnswerMove('two effects for one', complete, if_complete(two_for_one.exchanged)),),
)
