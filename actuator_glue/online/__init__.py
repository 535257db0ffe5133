"""Sliding windows and the estimator as a pure state machine (no clock, no ROS)."""
