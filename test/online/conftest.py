"""Property tests compile kernels on their first example: no deadline per example."""

from hypothesis import settings

settings.register_profile('compiled', deadline=None)
settings.load_profile('compiled')
