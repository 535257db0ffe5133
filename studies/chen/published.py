"""What the paper prints: every number that ours are set beside."""

from __future__ import annotations

import numpy as np

SOURCE = (
    'Chen, Peng, Martinez, Xu, Dy Cornejo: Uncertainty estimation of servo-hydraulic dynamics '
    'for real-time testing'
)

# Table 3: bounds of the uniform priors, in the order of the library's BASE (SI units).
TABLE_3 = np.array([[0.0, 4e2], [0.0, 2e10], [0.0, 1e7], [0.0, 1e2]])
# G_1 ... G_8 of Section 3.1, and the ones Figs. 5 and 6 show.
SHAPING_FACTORS: tuple[float, ...] = tuple(2.0**power for power in range(13, 5, -1))
SHOWN = {'G_1': 2.0**13, 'G_6': 2.0**8, 'G_8': 2.0**6}
CHOSEN = 2.0**8
THRESHOLD = 1.2  # R-hat, dashed line of Fig. 6
CLOSE_UPS = (1.0, 5.0, 10.0)  # Hz, Figs. 3, 4, 8-11
AMPLITUDE = 2e-3  # m, of the sweeps

# Table 4, of beta_1, alpha_1 beta_0, alpha_2, alpha_3.
TABLE_4 = {
    'mean': np.array([146.27, 1.26e9, 2.84e5, 1.77]),
    'stddev': np.array([34.74, 3.61e8, 6.38e4, 1.52]),
    'skewness': np.array([1.28, 1.13, 0.99, 1.52]),
    'cov': np.array([0.24, 0.29, 0.23, 0.86]),
}
# Change of the mean from Table 2 as the text gives it.
CHANGE = np.array([0.143, 0.248, 0.174, 28.50])

# The two ranges of Figs. 10 and 11 that the text quotes: amplitude at 1 Hz of the free test [dB],
# and phase at 10 Hz of the spring test, which is printed as "degree".
AMPLITUDE_1HZ_FREE = (-0.2, 0.05)
PHASE_10HZ_SPRING = (-1.9, -1.5)
