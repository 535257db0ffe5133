"""The prediction of `rths` put to the test on simulated actuators."""
