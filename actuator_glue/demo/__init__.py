"""The demonstration: the whole suite for a minute, as a user would run it."""
