"""The fast likelihood of Eq. (2): sums of squares without simulating (docs/fast_path.md)."""

from actuator_glue.model.fast.errors import FastErrors

__all__ = ['FastErrors']
