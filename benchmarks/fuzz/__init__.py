"""A coverage-guided fuzzer over everything that reads what others made: `make fuzz`."""
