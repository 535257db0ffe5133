"""Moves on an answer: what a search that adds one effect at a time cannot reach."""
