"""Effects of the measurement, which leave no mean response: hum, grid, jitter."""
