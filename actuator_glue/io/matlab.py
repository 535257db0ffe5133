"""Variables out of MATLAB .mat files (up to version 7)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.io.signature import refuse_foreign
from actuator_glue.records import Array


def read_variables(path: Path) -> tuple[dict[str, Array], dict[str, str]]:
    """Return numeric vectors and texts of a file by name; fields of structs as `struct.field`.

    Raises:
        InputError: no MAT-file, version 7.3, or no vector in it.
    """
    from scipy.io import loadmat
    from scipy.io.matlab import MatReadError

    refuse_foreign(path, 'a MATLAB .mat file')
    try:
        content = loadmat(path, squeeze_me=True, struct_as_record=False)
    except NotImplementedError as error:
        raise InputError(
            f'{path}: MAT-file version 7.3 (HDF5) is not read; save it in MATLAB with '
            "save('name.mat', ..., '-v7')"
        ) from error
    except OSError as error:
        raise InputError(f'{path}: cannot be read ({error.strerror or error})') from error
    except (MatReadError, ValueError, TypeError, KeyError, EOFError, IndexError) as error:
        raise InputError(f'{path}: this is not a MATLAB .mat file ({error})') from error
    except Exception as error:  # zlib.error and others, by the file's bytes
        raise InputError(f'{path}: damaged MAT-file ({error})') from error
    vectors: dict[str, Array] = {}
    texts: dict[str, str] = {}
    for name, value in content.items():
        if not name.startswith('__'):
            _collect(name, value, vectors, texts)
    if not vectors:
        raise InputError(f'{path}: no numeric vector in this file')
    return vectors, texts


def _collect(name: str, value: Any, vectors: dict[str, Array], texts: dict[str, str]) -> None:
    if hasattr(value, '_fieldnames'):
        for entry in value._fieldnames:
            _collect(f'{name}.{entry}', getattr(value, entry), vectors, texts)
        return
    if isinstance(value, str):
        texts[name] = value
        return
    array = np.asarray(value)
    if array.dtype.kind in 'fiu' and array.ndim <= 1:
        vectors[name] = np.atleast_1d(array).astype(np.float64)
