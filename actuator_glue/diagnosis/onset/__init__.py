"""Effects that begin in the middle of a record: when, and how."""
