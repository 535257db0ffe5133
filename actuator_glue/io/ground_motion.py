"""Ground motions from files: PEER's AT2, and delimited text."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.hybrid.ground_motion import GroundMotion, artificial
from actuator_glue.io.signature import text_encoding
from actuator_glue.records import Array

GRAVITY = 9.80665  # m/s^2
_LARGEST = 200_000_000  # bytes
_NUMBER = re.compile(r'[-+]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][-+]?\d+)?')
_UNEVEN = 0.02  # share of the sample period


def read_ground_motion(given: Path | str) -> GroundMotion:
    """Return the ground motion of a file, or an artificial one.

    Args:
        given: 'artificial' or 'artificial:SEED'; a file of PEER's AT2 format (in g); or delimited
            text with columns time [s] and acceleration [m/s^2], a heading allowed.

    Raises:
        InputError: no such file, or one that holds no ground motion.
    """
    name, _, seed = str(given).partition(':')
    path = Path(given)
    if name == 'artificial' and not path.exists():
        if seed and not seed.isdigit():
            raise InputError(f'{given}: {seed!r} is no seed; give artificial:1 for example')
        return artificial(int(seed or 1))
    try:
        if path.stat().st_size > _LARGEST:
            raise InputError(f'{path}: is no ground motion but {path.stat().st_size} bytes')
        text = path.read_text(text_encoding(path))
    except OSError as error:
        raise InputError(
            f'{path}: ground motion cannot be read ({error.strerror}); give a file, or artificial'
        ) from error
    except UnicodeDecodeError as error:
        raise InputError(f'{path}: ground motion is not text in UTF-8') from error
    found = re.search(r'\bDT\s*=\s*(' + _NUMBER.pattern + ')', text[:2000], re.IGNORECASE)
    if found is not None:
        return _at2(path, text, _float(found.group(1)))
    return _columns(path, text)


def _float(text: str) -> float:
    return float(text.replace('D', 'E').replace('d', 'e'))


def _at2(path: Path, text: str, period: float) -> GroundMotion:
    """Return PEER's: a heading that ends with NPTS and DT, then accelerations in g, row by row."""
    lines = text.splitlines()
    heading = next(i for i, line in enumerate(lines) if re.search(r'\bDT\s*=', line, re.I))
    if not re.search(r'\bg\b|units of g', ' '.join(lines[: heading + 1]), re.IGNORECASE):
        raise InputError(f'{path}: an AT2 file says `UNITS OF G`; this one does not')
    try:
        values = np.array([_float(v) for line in lines[heading + 1 :] for v in line.split()])
    except ValueError as error:
        raise InputError(f'{path}: a value below the heading is no number ({error})') from error
    count = re.search(r'\bNPTS\s*=\s*(\d+)', text[:2000], re.IGNORECASE)
    if count is not None and int(count.group(1)) != len(values):
        raise InputError(f'{path}: NPTS is {count.group(1)}, but {len(values)} values follow')
    return GroundMotion(GRAVITY * values, period, path.name)


def _columns(path: Path, text: str) -> GroundMotion:
    """Return a table's: time and acceleration."""
    rows: list[list[float]] = []
    for number, line in enumerate(text.splitlines(), 1):
        if not line.strip() or line.lstrip().startswith(('#', '%')):
            continue
        try:
            values = [_float(v) for v in re.split(r'[,;\s]+', line.strip().strip(',;'))]
        except ValueError as error:
            if rows:
                raise InputError(
                    f'{path}: line {number} is not numbers ({line.strip()!r})'
                ) from error
            continue  # a heading
        if len(values) != 2:
            raise InputError(
                f'{path}: line {number} has {len(values)} numbers; give time [s] and ground '
                'acceleration [m/s^2]'
            )
        rows.append(values)
    if len(rows) < 2:
        raise InputError(f'{path}: holds no ground motion: no rows of time and acceleration')
    table: Array = np.array(rows)
    steps = np.diff(table[:, 0])
    period = float(np.median(steps))
    if not period > 0.0 or np.abs(steps - period).max() > _UNEVEN * period:
        raise InputError(f'{path}: times do not rise evenly; resample the ground motion first')
    return GroundMotion(table[:, 1], period, path.name)
