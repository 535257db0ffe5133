"""A refit among many minima goes on to a lower one; one that is alone stays."""

from dataclasses import replace

import numpy as np
import pytest

from actuator_glue.inference.least_squares.data import Data
from actuator_glue.inference.least_squares.fit import Fit, fit
from actuator_glue.inference.least_squares.scatter import scattered
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array, Record

RATE, NOISE = 128.0, 1e-5
THETA = [196.0, 6.0e9, 5.3e5, 0.2]


def data(model: Structure, theta: Array) -> Data:
    """Sweeps of 10 s to 6 Hz with two specimens, 10 um of noise."""
    rng, t = np.random.default_rng(7), np.arange(int(10 * RATE)) / RATE
    u = 2e-3 * np.sin(np.pi * (6.0 / 10.0) * t**2)
    out = []
    for k in (100e3, 300e3):
        y = model.simulate(theta, Record(u, u, 1 / RATE, stiffness=k))
        out.append(Record(u, y + NOISE * rng.standard_normal(len(u)), 1 / RATE, stiffness=k))
    return Data.whole(out)


@pytest.mark.parametrize(
    ('count', 'above', 'left'), [(3, 2, 0), pytest.param(10, 6, 3, marks=pytest.mark.slow)]
)
def test_a_lower_minimum_is_reached(count: int, above: int, left: int) -> None:
    """A gap beside a valve's play: of ten starts six end above the noise, and one then."""
    model = Structure(('valve-null', 'specimen-gap', 'valve-hysteresis'))
    truth = np.array([*THETA, 3e-5, 2.8e-4, 4e-5])
    some = data(model, truth)
    starts = truth * np.exp(np.random.default_rng(3).standard_normal((count, len(truth))))
    ended = [fit(some, model, start, tolerance=1e-5) for start in starts]
    lower = [scattered(some, model, found, 1e-5) for found in ended]
    assert all(b.rms <= a.rms for a, b in zip(ended, lower, strict=True))
    assert all(found.work > 0 for found in lower)

    def high(fits: list[Fit]) -> int:
        return sum(found.rms > 1.05 * NOISE for found in fits)

    assert high(ended) >= above
    assert high(lower) <= left


def test_a_lone_minimum_stays() -> None:
    """Of Eq. (2): what is found is returned, with the work that it took."""
    some = data(Structure(()), np.array(THETA))
    found = fit(some, Structure(()), np.array(THETA))
    again = scattered(some, Structure(()), found, 1e-5)
    np.testing.assert_array_equal(again.theta, found.theta)
    assert again.rms == pytest.approx(found.rms, rel=1e-12)


@pytest.mark.filterwarnings('error')
def test_a_fit_that_diverged_is_returned() -> None:
    """It has no slopes, which scatter nothing; and no warning is told."""
    model = Structure(())
    some = data(model, np.array(THETA))
    found = fit(some, model, np.array(THETA))
    none = replace(found, error=np.ones_like(found.error), slopes=np.zeros_like(found.slopes))
    again = scattered(some, model, none, 1e-5)
    assert again.rms <= none.rms
    assert np.isfinite(again.theta).all()
