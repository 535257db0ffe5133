"""Refits."""

import warnings
from dataclasses import replace

import numpy as np
import pytest

from actuator_glue.diagnosis.posterior.identifiable import Working, derivatives
from actuator_glue.inference.carried import Carried
from actuator_glue.inference.least_squares import fit as module
from actuator_glue.inference.least_squares.base_prior import BasePrior
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.inference.least_squares.fit import base_starts, fit
from actuator_glue.inference.least_squares.space import UPPER, Space, jacobian
from actuator_glue.model import commands
from actuator_glue.model.parameters import NAMES, Parameter
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array, Record


@pytest.mark.parametrize('limit', ['LANES', '_HELD'])
@pytest.mark.parametrize(('effects', 'own'), [((), ()), (('backlash',), (1e-4,))])
def test_differences_ahead_change_no_bit(
    effects: tuple[str, ...],
    own: tuple[float, ...],
    limit: str,
    monkeypatch: pytest.MonkeyPatch,
    rng_seed: int,
) -> None:
    """Those of the steps tried are those that would be taken at the step chosen.

    They are not taken where the kernels take longer for them, or memory does not hold them.
    """
    model, rate = Structure(effects), 500.0
    theta = np.array([134.0, 1.1e9, 2.5e5, 0.5, *own])
    command = np.asarray(commands.sweep(rate, 8.0))
    bare = Record(command, np.zeros(len(command)), 1.0 / rate, 250e3)
    noise = 3e-6 * np.random.default_rng(rng_seed).standard_normal(len(command))
    data = Data.whole([Record(command, model.simulate(theta, bare) + noise, 1.0 / rate, 250e3)])
    start = theta * np.where(np.arange(len(theta)) < 4, 1.3, 0.5)
    ahead = fit(data, model, start, iterations=8)
    monkeypatch.setattr(module, limit, 1)
    after = fit(data, model, start, iterations=8)
    assert ahead.rms < 1e-5
    for name in ('theta', 'error', 'jacobian', 'z'):
        assert np.array_equal(getattr(ahead, name), getattr(after, name))


class Edge:
    """A response in proportion to its last parameter, unstable beyond an edge of it."""

    parameters = (*Structure(()).parameters, Parameter('size', 'm', 0.0, 1.0, '', 0.0))

    def __init__(self, low: float, high: float) -> None:
        self.low, self.high = low, high

    def simulate(self, theta: Array, record: Record, **_: object) -> Array:
        """Free run (m, n)."""
        size = theta[:, 4:]
        grown = np.where((size > self.high) | (size < self.low), 1e225, size)
        return np.asarray(grown * record.command)


@pytest.mark.parametrize(('low', 'known'), [(0.0, 1.0), (0.5, 0.0)])
def test_a_derivative_is_taken_on_the_stable_side(low: float, known: float) -> None:
    """A step over the edge leaves no number of 200 digits; where both are unstable it is zero."""
    model, command = Edge(low, 0.5), np.linspace(0.0, 1e-3, 100)
    data = Data.whole([Record(command, command, 0.01, 0.0)])
    space = Space(model, 1.0)
    z = space.z(np.array([[134.0, 1.1e9, 2.5e5, 0.5, 0.5]]))
    found = jacobian(data, model, space, z, data.simulate(model, space.theta(z)))
    assert np.allclose(found[0, 4], known * command)
    seen, to_both = derivatives(
        Working(space), space, z[0], lambda theta: data.simulate(model, theta)
    )
    assert np.allclose(seen, 0.5 * command)
    assert np.allclose(to_both[4], known * command)


def test_a_start_far_from_a_prior_is_finite() -> None:
    """Its objective was infinite, and infinity less infinity a warning on the screen.

    A narrow prior and few samples: e^(r'r/N) of the usual starts is beyond any number.
    """
    model, rate = Structure(()), 200.0
    theta = np.array([134.0, 1.1e9, 2.5e5, 0.5])
    command = np.asarray(commands.sweep(rate, 5.0))
    bare = Record(command, np.zeros(len(command)), 1.0 / rate, 250e3)
    records = [Record(command, model.simulate(theta, bare), 1.0 / rate, 250e3)]
    logs = 1e-5 * np.random.default_rng(1).standard_normal((400, 4))
    carried = Carried(NAMES, theta * np.exp(logs))
    data = replace(Data.whole(records), prior=BasePrior(carried, UPPER))
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        found = fit(data, model, base_starts(data))
    np.testing.assert_allclose(found.theta, theta, rtol=1e-4)
