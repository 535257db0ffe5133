"""What an actuator's uncertainty means for a hybrid test: loop, delay margin, stability."""
