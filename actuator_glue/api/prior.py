"""Earlier calibrations as priors of a calibration or a diagnosis."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from actuator_glue.api.calibration_result import Calibration
from actuator_glue.errors import InputError
from actuator_glue.inference.carried import Drift
from actuator_glue.inference.prior_use import GivenPrior


def check_prior(drift: float, age: float) -> None:
    """Refuse a drift [h^-1/2] or an age [s] that is none.

    Raises:
        InputError: one of them.
    """
    if not 0.0 <= age < np.inf:
        raise InputError(f'prior_age {age:g} s is no time since a calibration')
    Drift(drift)


def given_prior(
    earlier: Calibration | GivenPrior | Path | str | None, drift: float, age: float
) -> GivenPrior | None:
    """Return what an earlier calibration, or the file it was saved to, lets one know now.

    Args:
        earlier: None for nothing; what is known now already stays as it is.
        drift: standard deviation by which the logarithm of each parameter may have moved in an
            hour since (random walk) [h^-1/2].
        age: time since [s].

    Raises:
        InputError: a file that holds no calibration, or numbers as `check_prior`.
    """
    check_prior(drift, age)
    if earlier is None or isinstance(earlier, GivenPrior):
        return earlier
    source = 'a calibration' if isinstance(earlier, Calibration) else str(earlier)
    found = earlier if isinstance(earlier, Calibration) else Calibration.load(earlier)
    return GivenPrior(found.carried().drifted(Drift(drift), age), source, drift, age)
