"""A long test with faults at random moments: `make soak`."""
