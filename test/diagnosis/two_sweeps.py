"""Machines under sweeps, and what a search says of them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import chain, repeat

import numpy as np

from actuator_glue.diagnosis.refits.refits import Refits
from actuator_glue.diagnosis.search.beam_search import BeamSearch
from actuator_glue.diagnosis.selection import Selection
from actuator_glue.diagnosis.thresholds import Thresholds
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array, Record

RATE, NOISE = 128.0, 1e-5
THETA = np.array([235.0, 5.0e10, 4.23e6, 3.3])


def sweep(stroke: float, hertz: float, seconds: float) -> Array:
    """Sweep from 0 Hz [m]."""
    t = np.arange(int(seconds * RATE)) / RATE
    return np.asarray(stroke * np.sin(np.pi * (hertz / seconds) * t**2))


def selected(
    names: tuple[str, ...],
    effects: Mapping[str, float],
    stroke: float,
    hertz: float,
    seconds: float,
    seed: int = 1,
) -> tuple[BeamSearch, Selection]:
    """Sweeps with two specimens; `names` are tried, all parameters of an effect are its size."""
    u = sweep(stroke, hertz, seconds)
    return selected_of(names, motions(effects, THETA, u, (100e3, 400e3)), seed)


def motions(
    effects: Mapping[str, float], theta: Array, u: Array, stiffnesses: tuple[float, ...]
) -> list[tuple[float, Array, Array]]:
    """Stiffness, command and displacement of tests of a machine that the catalogue holds."""
    model = Structure(tuple(effects))
    values = model.neutral(theta)
    for name, size in effects.items():
        values[model.columns(name)] = size
    return [
        (k, u, model.simulate(values, Record(u, u, 1 / RATE, stiffness=k))) for k in stiffnesses
    ]


def selected_of(
    names: tuple[str, ...],
    tests: Iterable[tuple[float, Array, Array]],
    seed: int = 1,
    sources: Iterable[str] = (),
) -> tuple[BeamSearch, Selection]:
    """What `names` say of stiffness, command and displacement of each test, noise added."""
    rng = np.random.default_rng(seed)
    records = [
        Record(u, y + NOISE * rng.standard_normal(len(y)), 1 / RATE, stiffness=k, source=source)
        for (k, u, y), source in zip(tests, chain(sources, repeat('')), strict=False)
    ]
    beam = BeamSearch(Refits(Data.whole(records), names), Thresholds(), lambda s, d: None)
    return beam, beam.run()
