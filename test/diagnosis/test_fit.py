"""Refits."""

import numpy as np
import pytest

from actuator_glue.diagnosis import fit as module
from actuator_glue.diagnosis.data import Data
from actuator_glue.diagnosis.fit import fit
from actuator_glue.model import commands
from actuator_glue.model.structure import Structure
from actuator_glue.records import Record


@pytest.mark.parametrize(('effects', 'own'), [((), ()), (('backlash',), (1e-4,))])
def test_differences_ahead_change_no_bit(
    effects: tuple[str, ...], own: tuple[float, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Those of the steps tried are those that would be taken at the step chosen."""
    model, rate = Structure(effects), 500.0
    theta = np.array([134.0, 1.1e9, 2.5e5, 0.5, *own])
    command = np.asarray(commands.sweep(rate, 8.0))
    bare = Record(command, np.zeros(len(command)), 1.0 / rate, 250e3)
    noise = 3e-6 * np.random.default_rng().standard_normal(len(command))
    data = Data.whole([Record(command, model.simulate(theta, bare) + noise, 1.0 / rate, 250e3)])
    start = theta * np.where(np.arange(len(theta)) < 4, 1.3, 0.5)
    ahead = fit(data, model, start, iterations=8)
    monkeypatch.setattr(module, 'LANES', 0)
    after = fit(data, model, start, iterations=8)
    assert ahead.rms < 1e-5
    for name in ('theta', 'error', 'jacobian', 'z'):
        assert np.array_equal(getattr(ahead, name), getattr(after, name))
