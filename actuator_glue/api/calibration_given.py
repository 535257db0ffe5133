"""A calibration as callers give it: itself, or as the file it was saved to."""

from __future__ import annotations

import os

from actuator_glue.api.calibration_result import Calibration
from actuator_glue.errors import InputError


def calibration_given(given: Calibration | os.PathLike[str] | str) -> Calibration:
    """Return a calibration that was given itself, or the file it was saved to.

    Raises:
        InputError: something else was given, or the file holds none.
    """
    if isinstance(given, Calibration):
        return given
    if isinstance(given, (str, os.PathLike)):
        return Calibration.load(os.fspath(given))
    raise InputError(
        f'{type(given).__name__} is no calibration; give what `calibrate` returns, or the file '
        'it was saved to'
    )
