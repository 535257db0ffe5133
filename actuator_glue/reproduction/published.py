"""What the paper prints: every number that ours are set beside."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from actuator_glue.records import Array

SOURCE = (
    'Chen, Peng, Martinez, Xu, Dy Cornejo: Uncertainty estimation of servo-hydraulic dynamics '
    'for real-time testing'
)

# G_1 ... G_8 of Section 3.1, and the ones Figs. 5 and 6 show.
SHAPING_FACTORS: tuple[float, ...] = tuple(2.0**power for power in range(13, 5, -1))
SHOWN = {'G_1': 2.0**13, 'G_6': 2.0**8, 'G_8': 2.0**6}
CHOSEN = 2.0**8
THRESHOLD = 1.2  # R-hat, dashed line of Fig. 6
CLOSE_UPS = (1.0, 5.0, 10.0)  # Hz, Figs. 3, 4, 8-11


class Table4(NamedTuple):
    """Table 4, in the order of `model.parameters.BASE` (SI units)."""

    mean: Array
    stddev: Array
    skewness: Array
    cov: Array


TABLE_4 = Table4(
    mean=np.array([146.27, 1.26e9, 2.84e5, 1.77]),
    stddev=np.array([34.74, 3.61e8, 6.38e4, 1.52]),
    skewness=np.array([1.28, 1.13, 0.99, 1.52]),
    cov=np.array([0.24, 0.29, 0.23, 0.86]),
)
# Change of the mean from Table 2 as the text gives it.
CHANGE = np.array([0.143, 0.248, 0.174, 28.50])

# The two ranges of Figs. 10 and 11 that the text quotes. The second is printed in degrees; the
# phase of Eq. (3b) at 10 Hz is -102.5 degrees = -1.79 rad, so the figure's axis is in radians.
AMPLITUDE_1HZ_FREE_DB = (-0.2, 0.05)
PHASE_10HZ_SPRING_RAD = (-1.9, -1.5)
