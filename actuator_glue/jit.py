"""One place for how kernels are compiled: cached on disk, IEEE except for reassociation."""

from __future__ import annotations

from functools import partial
from typing import Any

import numba

# Reassociation and contraction let LLVM use vector and fused instructions; NaN and infinity keep
# their meaning (a diverging simulation must stay visible as such).
njit: Any = partial(
    numba.njit, cache=True, error_model='numpy', fastmath={'reassoc', 'contract', 'nsz', 'arcp'}
)
