"""Moves for material structure: learned terms and, where none is worth it, two effects at once."""

from __future__ import annotations

from typing import Final

from actuator_glue.diagnosis.moves import describe, two_effects
from actuator_glue.diagnosis.moves.move import AnswerMove, Groups, if_complete, left, unexplained

LEARNED_TERMS: Final[Groups] = (
    (
        AnswerMove('learned terms', left, describe.with_terms),
        AnswerMove(
            'two effects at once', unexplained, if_complete(two_effects.explained, apart=True)
        ),
    ),
)
