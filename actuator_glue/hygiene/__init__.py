"""What a record must be, and what is taken out of it, before any calibration or diagnosis."""
