"""All moves, in the order in which they are tried.

A search that adds one effect at a time ends with an answer (beam_search.py). Answers that it
cannot reach are tried here: another scope, another form, other names for everything. Of each group
the heaviest answer is taken, until none has more weight.
"""

from __future__ import annotations

from typing import Final

from actuator_glue.diagnosis.moves.heaviest_known import heaviest_known
from actuator_glue.diagnosis.moves.learned_terms import with_terms
from actuator_glue.diagnosis.moves.move import (
    AnswerMove,
    Groups,
    always,
    as_given,
    complete,
    described,
    to,
    unexplained,
    without_own,
)
from actuator_glue.diagnosis.moves.other_hold import other_hold
from actuator_glue.diagnosis.moves.own_setting import own_setting
from actuator_glue.diagnosis.moves.reserved_effects import with_reserved
from actuator_glue.diagnosis.moves.since_onset import since_onset
from actuator_glue.diagnosis.moves.taken_for_noise import taken_for_noise
from actuator_glue.diagnosis.moves.transducer_in_loop import in_the_loop
from actuator_glue.diagnosis.moves.two_effects import explained
from actuator_glue.diagnosis.moves.two_for_one import exchanged

# Moves under one hold and one onset. A description may imitate names and settings; a search of
# its own comes last, as none is begun once the effort is spent.
WITHIN: Final[Groups] = (
    (
        AnswerMove('learned terms', described, to(with_terms)),
        AnswerMove("one record's own setting", described, own_setting),
        AnswerMove('effects reserved for the rest', unexplained, with_reserved),
    ),
    (AnswerMove("the transducer's fault inside the loop", always, to(in_the_loop)),),
    (AnswerMove('learned terms', complete, to(with_terms), each_time=False),),
    (AnswerMove("one record's own setting", unexplained, own_setting),),
)
# Moves across holds and onsets. A change during the test can look like another hold.
ACROSS: Final[Groups] = (
    (
        AnswerMove('the other hold of the command', as_given, other_hold),
        AnswerMove('the data since something appeared', always, since_onset),
    ),
    (AnswerMove('two effects at once', unexplained, to(explained)),),
    (AnswerMove('effects that matter after all', complete, to(taken_for_noise)),),
    (AnswerMove('two effects for one', complete, to(exchanged)),),
    (AnswerMove('the heaviest structure known', without_own, to(heaviest_known), refits=False),),
)
