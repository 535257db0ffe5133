"""Which one thing changed while a test ran."""

import numpy as np
import pytest

from actuator_glue.diagnosis.scopes.change import STIFFNESS, alone
from actuator_glue.diagnosis.trial import Trial
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.inference.least_squares.fit import base_fit
from actuator_glue.model.parameters import NAMES
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array, Record

RATE, NOISE, K = 200.0, 1e-5, 3e6
THETA = np.array([160.0, 1.9e10, 3.5e6, 1.2])
# Least rms error that matters: half of the noise.
MATERIAL = 0.5 * NOISE


def records(theta: Array, k: float, seconds: float, rng: np.random.Generator) -> list[Record]:
    """A sweep without and with the specimen, told to be K."""
    t = np.arange(0.0, seconds, 1.0 / RATE)
    command = 3e-3 * np.sin(np.pi * (10.0 / seconds) * t**2)
    out = []
    for told, true in ((0.0, 0.0), (K, k)):
        bare = Record(command, np.zeros(len(t)), 1.0 / RATE, stiffness=true)
        measured = Structure().simulate(theta, bare) + NOISE * rng.standard_normal(len(t))
        out.append(Record(command, measured, 1.0 / RATE, stiffness=told))
    return out


@pytest.mark.parametrize('name', [*NAMES, STIFFNESS])
@pytest.mark.parametrize('factor', [0.8, 1.3])
def test_one_thing_that_changed_is_told(name: str, factor: float, rng_seed: int) -> None:
    """Of 400 machines all were told."""
    rng = np.random.default_rng(rng_seed)
    theta, k = THETA * np.exp(0.1 * rng.standard_normal(4)), K
    before = Trial(
        Structure(), '', base_fit(Data.whole(records(theta, k, 12.0, rng))), np.zeros(0)
    )
    if name == STIFFNESS:
        k *= factor
    else:
        theta[NAMES.index(name)] *= factor
    since = Data.whole(records(theta, k, 12.0, rng))
    told = alone(before, since, base_fit(since).rms, MATERIAL)
    assert told is not None and told.name == name
    assert told.factor == pytest.approx(factor, rel=0.1)


def test_two_things_that_changed_are_not_one(rng_seed: int) -> None:
    """Nor is a machine that nothing describes since then."""
    rng = np.random.default_rng(rng_seed)
    before = Trial(
        Structure(), '', base_fit(Data.whole(records(THETA, K, 12.0, rng))), np.zeros(0)
    )
    changed = THETA * [1.0, 1.2, 1.0, 4.0]
    since = Data.whole(records(changed, 0.7 * K, 12.0, rng))
    assert alone(before, since, base_fit(since).rms, MATERIAL) is None
