"""One place for how kernels are compiled: cached on disk, IEEE except for reassociation."""

from __future__ import annotations

from functools import partial
from typing import Any

import numba

# Reassociation and contraction let LLVM use vector and fused instructions; NaN and infinity keep
# their meaning (a diverging simulation must stay visible as such).
# A function that another one calls is inlined, whatever its size: the process that compiles would
# otherwise link the callee's own code, every later one the copy in the caller's cached object, and
# the two may add up in another order. A replay must repeat a live run to the bit.
njit: Any = partial(
    numba.njit,
    cache=True,
    forceinline=True,
    error_model='numpy',
    fastmath={'reassoc', 'contract', 'nsz', 'arcp'},
)
