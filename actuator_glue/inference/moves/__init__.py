"""Moves of the sampler: one file each, all in sampling coordinates, all reversible.

A move is a compiled function that writes a candidate for one chain and returns the log of its
Hastings correction q(candidate -> z) / q(z -> candidate). Random numbers come in as a row of
uniforms, so that a generation uses the same number of them whatever happens. What every move must
pass is in test/inference/test_moves.py.
"""

from typing import Final

PARALLEL: Final = 0
SNOOKER: Final = 1
INDEPENDENCE: Final = 2
NAMES: Final = ('parallel', 'snooker', 'independence')

# Columns of the uniforms of one chain and generation; from U_FREE on they belong to its move.
U_MOVE: Final = 0
U_ACCEPT: Final = 1
U_FREE: Final = 2


def uniforms_per_chain(dimension: int, pairs: int) -> int:
    """How many uniforms one chain may use in one generation."""
    parallel = 4 + 2 * pairs + 3 * dimension
    snooker = 4
    independence = dimension + 4
    return U_FREE + max(parallel, snooker, independence)
