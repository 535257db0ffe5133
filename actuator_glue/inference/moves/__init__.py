"""Moves of the sampler: one file each, all in sampling coordinates, all reversible.

A new move is a file with a `Move` and its place in `MOVES` here, or in `SamplerSettings.moves`
for one run. Random numbers come in as a row of uniforms, so that a step uses the same number of
them whatever happens. What every move must pass is in test/inference/test_moves.py.
"""

from typing import Final

from actuator_glue.inference.moves.independence import INDEPENDENCE
from actuator_glue.inference.moves.move import Move
from actuator_glue.inference.moves.parallel import PARALLEL
from actuator_glue.inference.moves.snooker import SNOOKER

# Those of DREAM(ZS) as Vrugt (2016) has it, and with what this package adds.
PUBLISHED: Final[tuple[Move, ...]] = (PARALLEL, SNOOKER)
MOVES: Final[tuple[Move, ...]] = (*PUBLISHED, INDEPENDENCE)
