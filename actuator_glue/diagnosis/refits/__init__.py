"""Structures refitted to the fitting part, each once."""
