"""What an actuator means for a hybrid test, in one sentence."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from actuator_glue.api.frequency_response import Limits
from actuator_glue.api.partition_given import partition_given
from actuator_glue.hybrid.coupled import coupled
from actuator_glue.hybrid.margin import pure_delay_margin
from actuator_glue.hybrid.partition import Partition


def hybrid_meaning(
    partition: Partition | Path | str, delay_at: Callable[[float, float], Limits]
) -> str:
    """Return how much delay a hybrid test bears, and how much the actuator has.

    The delay is that of the linear part of the model, at the lowest natural frequency of the
    structure, under the specimen of the test.

    Args:
        partition: the hybrid test; a YAML file, or the name of one that comes with the package.
        delay_at: of the actuator [s], given the specimen's stiffness [N/m] and a frequency [Hz].

    Raises:
        InputError: a partition that cannot be used.
    """
    partition = partition_given(partition)
    lowest = float(min(coupled(partition).natural_frequencies))
    delay = delay_at(partition.specimen.stiffness, lowest)
    middle, low, high = (1e3 * float(values[0]) for values in delay)
    margin = 1e3 * pure_delay_margin(partition)[1]
    has = f'at {lowest:.3g} Hz the actuator lags by {middle:.2f} ms ({low:.2f} to {high:.2f})'
    name = f'Hybrid test {partition.name}'
    if not np.isfinite(margin):
        return f'{name}: no pure delay makes it unstable; {has}.'
    if high < margin:
        told = f'{margin - middle:.2f} ms are left'
    elif low > margin:
        told = 'it is unstable without a compensator'
    else:
        told = 'whether it is stable is open'
    bears = f'it bears {margin:.2f} ms of delay' if margin > 0.0 else 'it bears no delay at all'
    return f'{name}: {bears}, {has}: {told}; rths tells more.'
