"""Peers on problem R: one file per package, each in its best working setting.

Every file defines `SAMPLERS: dict[str, Sampler]`; they run in the peers' own environment.
"""
