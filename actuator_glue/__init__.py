"""Online Bayesian calibration and diagnosis of servo-hydraulic actuators."""

__version__ = '0.1.0'
