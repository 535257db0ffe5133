"""Likelihoods, DREAM(ZS), convergence, moments and bands."""
