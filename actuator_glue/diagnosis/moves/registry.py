"""All moves, in the order in which they are tried.

A search that adds one effect at a time ends with an answer (beam_search.py). Answers that it
cannot reach are tried here: another scope, another form, other names for everything. Of each group
the heaviest answer is taken, until none has more weight.
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
    as_given,
    complete,
    described,
    to,
    unexplained,
)

# Moves under one hold and one onset. A description may imitate names and settings; a search of
# its own comes last, as none is begun once the effort is spent.
WITHIN: Final[Groups] = (
    (
        AnswerMove('learned terms', described, to(learned_terms.with_terms)),
        AnswerMove("one record's own setting", described, own_setting.own_setting),
        AnswerMove('effects reserved for the rest', unexplained, reserved.with_reserved),
    ),
    (AnswerMove("the transducer's fault inside the loop", always, to(feedback.in_the_loop)),),
    (AnswerMove('learned terms', complete, to(learned_terms.with_terms), each_time=False),),
    (AnswerMove("one record's own setting", unexplained, own_setting.own_setting),),
)
# Moves across holds and onsets. A change during the test can look like another hold.
ACROSS: Final[Groups] = (
    (
        AnswerMove('the other hold of the command', as_given, other_hold.other_hold),
        AnswerMove('the data since something appeared', always, since_onset.since_onset),
    ),
    (AnswerMove('two effects at once', unexplained, to(two_effects.explained)),),
    (AnswerMove('effects that matter after all', complete, to(that_matter.that_matter)),),
    (AnswerMove('two effects for one', complete, to(two_for_one.exchanged)),),
)
