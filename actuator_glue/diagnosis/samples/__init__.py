"""The samples that are judged: the fitting part and the held-out part, cleaned."""
