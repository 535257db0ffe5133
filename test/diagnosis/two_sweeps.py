"""A machine with known effects under two sweeps, and what a search says of it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from actuator_glue.diagnosis.data import Data
from actuator_glue.diagnosis.model_selection import ModelSelection
from actuator_glue.diagnosis.search import Search
from actuator_glue.diagnosis.selection import Selection
from actuator_glue.diagnosis.thresholds import Thresholds
from actuator_glue.model.structure import Structure
from actuator_glue.records import Record

RATE, NOISE = 128.0, 1e-5
THETA = np.array([235.0, 5.0e10, 4.23e6, 3.3])


def selected(
    names: tuple[str, ...],
    effects: Mapping[str, float],
    stroke: float,
    hertz: float,
    seconds: float,
) -> tuple[ModelSelection, Selection]:
    """Sweeps with two specimens; `names` are tried, all parameters of an effect are its size."""
    rng = np.random.default_rng()
    model = Structure(tuple(effects))
    t = np.arange(int(seconds * RATE)) / RATE
    command = stroke * np.sin(np.pi * (hertz / seconds) * t**2)
    values = model.neutral(THETA)
    for name, size in effects.items():
        values[model.columns(name)] = size
    records = []
    for k in (100e3, 400e3):
        y = model.simulate(values, Record(command, command, 1 / RATE, stiffness=k))
        y = y + NOISE * rng.standard_normal(len(t))
        records.append(Record(command, y, 1 / RATE, stiffness=k))
    selection = ModelSelection(Search(Data.whole(records), names), Thresholds(), lambda s, d: None)
    return selection, selection.run()
