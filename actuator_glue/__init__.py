"""Online Bayesian calibration and diagnosis of servo-hydraulic actuators."""

import os

__version__ = '0.1.0'

# Our matrices are small and our own threads and processes use the cores: BLAS threads on top only
# wait for each other (measured: a diagnosis takes 1.7 times the processor time). A choice of the
# user's stands; numpy imported before this package keeps its own.
os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')

# A workspace reaches the sources through links, a virtual environment does not: compiled code is
# kept by path, and both shall find it in one place.
__path__ = [os.path.realpath(folder) for folder in __path__]
