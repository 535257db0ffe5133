"""Streams for the tests: a plant's response cut into blocks."""

import numpy as np

from actuator_glue.model import linear
from actuator_glue.model.commands import noise
from actuator_glue.online.playback import stream
from actuator_glue.online.settings import EstimatorSettings
from actuator_glue.records import Record
from actuator_glue.sample_block import Block
from actuator_glue.setups import StreamSetup

THETA = np.array([134.0, 1.1e9, 2.5e5, 0.5])
RATE = 200.0
# Small and quick; what is tested does not depend on the size.
SETTINGS = EstimatorSettings(
    window=2.0, hop=0.5, settle=0.3, time_budget=0.5, evaluations=4000, start_evaluations=12_000
)


def record(seconds=6.0, stiffness=250e3, rate=RATE, sd=1e-5, seed=0, theta=THETA):
    """Response of Eq. (2) to band-limited noise, with sensor noise."""
    command = noise(rate, seconds, 0.2, 8.0, seed=seed)
    clean = linear.simulate(theta, command, stiffness=stiffness, period=1.0 / rate)
    measured = clean + sd * np.random.default_rng(seed + 1).standard_normal(len(clean))
    return Record(command, measured, 1.0 / rate, stiffness, start_ns=10**18)


def block(index, count=10, period=1.0 / RATE, stamp_ns=None, **channels):
    """A block of a ramp, so that samples are recognised by their value."""
    values = 1e-6 * np.arange(index, index + count, dtype=float)
    stamp = 10**18 + round(index / RATE * 1e9) if stamp_ns is None else stamp_ns
    given = {'command': values, 'measured': values + 1e-7} | channels
    return Block(index, period, stamp, **given)


def setup(stiffness=250e3, index=0, period=1.0 / RATE, **more):
    """A test set-up at the tests' rate."""
    return StreamSetup(stiffness, period, index=index, **more)


__all__ = ['RATE', 'SETTINGS', 'THETA', 'block', 'record', 'setup', 'stream']
