"""Draws over all plausible structures, from which every interval is told."""
