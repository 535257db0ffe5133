"""Earlier calibrations as priors of a calibration or a diagnosis."""

from __future__ import annotations

from datetime import timedelta
from pathlib import Path

import numpy as np

from actuator_glue.api import store
from actuator_glue.api.calibration_given import calibration_given
from actuator_glue.api.calibration_result import Calibration
from actuator_glue.api.given import seconds
from actuator_glue.api.pooled_prior import PooledPrior
from actuator_glue.errors import InputError
from actuator_glue.inference.carried import Drift
from actuator_glue.inference.prior_use import GivenPrior

DRIFT = 0.02  # h^-1/2, where nothing else is said


def check_prior(given: bool, drift: float, age: timedelta | float) -> float:
    """Return an age in seconds; refuse a drift [h^-1/2] or an age that cannot be used.

    Raises:
        InputError: either cannot be used, or is said where no prior is given.
    """
    since = seconds(age, 'prior_age')
    if not 0.0 <= since < np.inf:
        raise InputError(f'prior_age {since:g} s is no time since a calibration')
    Drift(drift)
    if not given and (drift != DRIFT or since):
        raise InputError(
            'drift and prior_age say how an earlier calibration has aged, and none is given; give '
            'it as prior, or leave both out'
        )
    return since


def given_prior(
    earlier: Calibration | GivenPrior | Path | str | None, drift: float, age: timedelta | float
) -> GivenPrior | None:
    """Return the prior that an earlier calibration, or the file it was saved to, gives now.

    Args:
        earlier: None for no prior; a `GivenPrior` stays as it is. A file may also hold what
            `history` made of many tests, a `PooledPrior`.
        drift: standard deviation by which the logarithm of each parameter may have moved in an
            hour since (random walk) [h^-1/2].
        age: time since, a `timedelta` or a number of seconds.

    Raises:
        InputError: a file that holds no calibration, or numbers as `check_prior`.
    """
    since = check_prior(earlier is not None, drift, age)
    if earlier is None or isinstance(earlier, GivenPrior):
        return earlier
    if isinstance(earlier, (str, Path)) and store.schema_of(earlier) == PooledPrior.schema:
        many = store.load(earlier, PooledPrior.schema, PooledPrior)
        known = many.carried().drifted(Drift(drift), since)
        return GivenPrior(known, f'{earlier} ({many.source})', drift, since)
    source = 'a calibration' if isinstance(earlier, Calibration) else str(earlier)
    found = calibration_given(earlier)
    left = found.structure
    doubt = '' if left is None or left.intervals_hold else left.amounts()
    known = found.carried().drifted(Drift(drift), since)
    return GivenPrior(known, source, drift, since, doubt, found.sketches)
