"""Effects of the measurement, which leave no mean response."""
