"""The plant: parameters, Eq. (2), the effect catalogue and its compiled kernels."""
