"""MCAP bags and laboratory files."""
