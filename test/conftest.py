"""Fixtures of every test."""

import os

import numpy as np
import pytest


@pytest.fixture
def rng_seed(request: pytest.FixtureRequest) -> int:
    """A seed that differs between runs; ACTUATOR_GLUE_TEST_SEED=N repeats a failed run.

    Tests that use it state how often they fail by chance.
    """
    given = os.environ.get('ACTUATOR_GLUE_TEST_SEED')
    seed = int(given) if given else int(np.random.SeedSequence().generate_state(1)[0])
    print(f'ACTUATOR_GLUE_TEST_SEED={seed}  # repeats {request.node.nodeid}')
    return seed
