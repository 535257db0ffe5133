"""Variables out of MATLAB .mat files (up to version 7)."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.io.channel_map import ChannelMap
from actuator_glue.io.formats import FileTable, Format
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


def _read(path: Path, channels: ChannelMap | None) -> FileTable:
    vectors, texts = read_variables(path)
    names = list(vectors)
    # `test.command_mm` is command_mm of the struct `test`; a map names it in full.
    shown = names if channels is not None else [_last(name) for name in names]
    notes = {_last(name): text for name, text in texts.items()}
    for name, vector in vectors.items():
        if _last(name) == 'stiffness_N_per_m' and len(vector) == 1:
            notes['stiffness_N_per_m'] = repr(float(vector[0]))
    return FileTable(shown, notes, lambda places: [vectors[names[at]] for at in places])


def _last(name: str) -> str:
    return name.rpartition('.')[2]


def _write(path: Path, columns: Mapping[str, Array], notes: Mapping[str, str | float]) -> None:
    from scipy.io import savemat

    savemat(str(path), {**columns, **notes}, appendmat=False, do_compression=True)


FORMAT = Format('.mat', _read, _write)
