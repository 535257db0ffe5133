"""The move for material structure: learned terms."""

from __future__ import annotations

from typing import Final

from actuator_glue.diagnosis.moves import describe
from actuator_glue.diagnosis.moves.move import AnswerMove, Groups, left

LEARNED_TERMS: Final[Groups] = ((AnswerMove('learned terms', left, describe.with_terms),),)
