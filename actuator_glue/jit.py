"""One place for how kernels are compiled and where compiled code is kept.

IEEE arithmetic except for reassociation and contraction.
"""

from __future__ import annotations

import hashlib
import logging
import os
import shutil
from collections.abc import Callable
from contextlib import suppress
from functools import cache, partial
from pathlib import Path
from typing import Any, NamedTuple, TypeVar, overload

import numba
from numba.core.caching import UserProvidedCacheLocator

_KEPT = 4


class Store(NamedTuple):
    """Where compiled code is kept.

    Attributes:
        folder: of the code; None for nowhere: every process compiles in its memory.
        written: whether what is compiled anew is put there.
    """

    folder: str | None
    written: bool

    def told(self) -> str:
        """Return what to tell where code is compiled in vain; empty where it is kept."""
        if self.written:
            return ''
        where = self.folder or 'the installation, or a cache in a home folder,'
        return (
            f'{where} cannot be written: what is compiled is kept in the memory of this process '
            'alone; let NUMBA_CACHE_DIR name a folder for it'
        )


def _name() -> str:
    """Return the name of the folder for the code of exactly these sources.

    numba looks at the file of a function alone: after an update a caller would go on with its
    copy of a callee that has changed in another file.
    """
    digest = hashlib.sha256()
    for path in sorted(Path(__file__).parent.rglob('*.py')):
        content = path.read_bytes()
        if b'njit' in content:
            digest.update(content)
    return f'compiled-{digest.hexdigest()[:16]}'


def _tidied(folder: Path) -> None:
    """Remove the code of other sources but the newest few.

    Not all: a process that began before an update may still write to its own. And whoever else
    starts now does the same.
    """
    others = [p for p in folder.parent.glob('compiled-*') if p != folder]
    with suppress(OSError):
        for other in sorted(others, key=os.path.getmtime)[:-_KEPT]:
            shutil.rmtree(other, ignore_errors=True)


def _writable(folder: Path) -> bool:
    """Return whether a folder can be written, made where it is missing; some only seem so."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        trial = folder / f'.{os.getpid()}'
        trial.touch()
        trial.unlink()
    except OSError:
        return False
    return True


def _store() -> Store:
    """Return where compiled code is kept on this computer: beside the sources where one may."""
    theirs = os.environ.get('NUMBA_CACHE_DIR')
    if theirs:
        return Store(theirs, _writable(Path(theirs)))
    name = _name()
    beside = Path(__file__).parent / '__pycache__' / name
    if _writable(beside):
        _tidied(beside)
        return Store(str(beside), True)
    if beside.is_dir():  # as in the image of a container that was warmed up when it was made
        return Store(str(beside), False)
    with suppress(RuntimeError):  # no home folder is known
        caches = os.environ.get('XDG_CACHE_HOME') or Path('~/.cache').expanduser()
        folder = Path(caches, 'actuator_glue', name)
        if folder.is_absolute() and _writable(folder):
            _tidied(folder)
            return Store(str(folder), True)
    return Store(None, False)


STORE = _store()
_tell = logging.getLogger(__name__).warning
if STORE.folder is None:
    _tell(STORE.told())


class ReadOnlyLocator(UserProvidedCacheLocator):
    """Finds compiled code in a folder that numba cannot write, which it would not look into."""

    def ensure_cache_path(self) -> None:
        """Raise an OSError where there is no code to read."""
        Path(self.get_cache_path()).stat()


# Reassociation and contraction let LLVM use vector and fused instructions; NaN and infinity keep
# their meaning (a diverging simulation must stay visible as such).
# A function that another one calls is inlined, whatever its size: the process that compiles would
# otherwise link the callee's own code, every later one the copy in the caller's cached object, and
# the two may add up in another order. A replay must repeat a live run to the bit.
# Functions that may take a tenth of a millisecond or more say nogil=True, and other threads run
# meanwhile; short ones would pay more for giving the lock back and regaining it than they free.
_compile: Any = partial(
    numba.njit,
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
    kept = options.pop('cache', True)
    compiled = _compile(function, **options)
    # Where nothing is compiled (NUMBA_DISABLE_JIT) the function itself comes back.
    if kept and STORE.folder is not None and not numba.config.DISABLE_JIT:
        _keep(compiled)
    return compiled


def _keep(compiled: Any) -> None:
    """Have numba read, and where it may write, the code of a function in our folder."""
    # numba asks for the folder when caching begins; other people's functions in this process keep
    # theirs.
    theirs = numba.config.CACHE_DIR, numba.config.CACHE_LOCATOR_CLASSES
    numba.config.CACHE_DIR = STORE.folder
    numba.config.CACHE_LOCATOR_CLASSES = (
        '' if STORE.written else f'{__name__}.{ReadOnlyLocator.__name__}'
    )
    try:
        compiled.enable_caching()
    except RuntimeError:  # nothing of this file's functions is there to be read
        return
    finally:
        numba.config.CACHE_DIR, numba.config.CACHE_LOCATOR_CLASSES = theirs
    if not STORE.written:
        compiled._cache.save_overload = _not_saved


@cache
def _say_once() -> None:
    _tell(STORE.told())


def _not_saved(*_: Any) -> None:
    """What numba calls with code that is not in a folder it can only read."""
    _say_once()
