"""One place for how kernels are compiled and where compiled code is kept.

IEEE arithmetic except for reassociation and contraction.
"""

from __future__ import annotations

import hashlib
import os
import shutil
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any, TypeVar, overload

import numba

_KEPT = 4


def _folder() -> Path:
    """Return the folder for the code of exactly these sources; of others the newest few stay.

    numba looks at the file of a function alone: after an update a caller would go on with its
    copy of a callee that has changed in another file.
    """
    package = Path(__file__).parent
    digest = hashlib.sha256()
    for path in sorted(package.rglob('*.py')):
        content = path.read_bytes()
        if b'njit' in content:
            digest.update(content)
    folder = package / '__pycache__' / f'compiled-{digest.hexdigest()[:16]}'
    others = [p for p in folder.parent.glob('compiled-*') if p != folder]
    # Not all: a process that began before an update may still write to its own. And whoever else
    # starts now does the same.
    with suppress(OSError):
        for other in sorted(others, key=os.path.getmtime)[:-_KEPT]:
            shutil.rmtree(other, ignore_errors=True)
    return folder


# None where somebody names a folder (NUMBA_CACHE_DIR), or where the package cannot be written.
_FOLDER = (
    str(_folder())
    if 'NUMBA_CACHE_DIR' not in os.environ and os.access(Path(__file__).parent, os.W_OK)
    else None
)

# Reassociation and contraction let LLVM use vector and fused instructions; NaN and infinity keep
# their meaning (a diverging simulation must stay visible as such).
# A function that another one calls is inlined, whatever its size: the process that compiles would
# otherwise link the callee's own code, every later one the copy in the caller's cached object, and
# the two may add up in another order. A replay must repeat a live run to the bit.
# What may take a tenth of a millisecond or more says nogil=True, and others run meanwhile; short
# functions would pay more for giving the lock back and fighting for it anew than it frees.
_compile: Any = partial(
    numba.njit,
    cache=True,
    forceinline=True,
    error_model='numpy',
    fastmath={'reassoc', 'contract', 'nsz', 'arcp'},
)

Function = TypeVar('Function', bound=Callable[..., Any])


@overload
def njit(function: Function) -> Function: ...
@overload
def njit(**options: Any) -> Callable[[Function], Function]: ...
def njit(function: Any = None, **options: Any) -> Any:
    """Compile a function when it is first called; used as a decorator, with or without options.

    Args:
        function: what to compile; its signature is kept for type checkers.
        options: options of numba.njit that replace the house's.
    """
    if function is None:
        return partial(njit, **options)
    # numba asks for the folder when a function is decorated; other people's functions in this
    # process keep theirs.
    theirs = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = _FOLDER or theirs
    try:
        return _compile(function, **options)
    finally:
        numba.config.CACHE_DIR = theirs
