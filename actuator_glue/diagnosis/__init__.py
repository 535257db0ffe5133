"""Detect, attribute, augment, verify: from a residual to the effect the model lacks."""
