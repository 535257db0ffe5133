"""Results of a campaign whose truth is known: days around a level that walks and jumps."""

import json
from dataclasses import dataclass, field
from datetime import date, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from actuator_glue.model.parameters import NAMES, TABLE_2

DAY = np.array([0.010, 0.015, 0.010, 0.08])
KNOWN = np.array([0.002, 0.003, 0.002, 0.05])
_WALK = np.array([0.0004, 0.0006, 0.0004, 0.004])


@dataclass
class Truth:
    """What nobody but the test knows: logarithms of the parameters on each day, (n, 4)."""

    days: list[str] = field(default_factory=list)
    logs: list[np.ndarray] = field(default_factory=list)


def write_table(
    folder: Path,
    seed: int,
    days: int = 60,
    jump: tuple[int, tuple[float, ...]] | None = None,
    actuator: str = 'north',
    ageing: float = 1.0,
    **columns: Any,
) -> Truth:
    """Write `results.parquet` with a test every third day; add to what is there.

    Args:
        folder: of the campaign.
        seed: of days and tests.
        days: of test.
        jump: day of test from which on the logarithms are others, and by how much.
        actuator: its name.
        ageing: how many times the usual walk its level walks.
        columns: further columns, by name, a value for each day.
    """
    rng = np.random.default_rng(seed)
    level, truth, rows = np.log(TABLE_2), Truth(), []
    for i in range(days):
        level = level + ageing * np.sqrt(3.0) * _WALK * rng.standard_normal(4)
        if jump is not None and i == jump[0]:
            level = level + np.array(jump[1])
        day = (date(2025, 1, 1) + timedelta(days=3 * i)).isoformat()
        log = level + DAY * rng.standard_normal(4)
        told = log + KNOWN * rng.standard_normal(4)
        row = {
            'group': f'{actuator}/{day}',
            'actuator': actuator,
            'day': day,
            'started': f'{day}T09:00:00',
            'verdict': 'none',
            'effects': '',
            'failure': '',
            'error_after_m': 1e-5,
            'noise_m': 1e-5,
            'report': None,
            'pooling': json.dumps(
                {
                    'names': NAMES,
                    'mean': told.tolist(),
                    'covariance': np.diag(KNOWN**2).tolist(),
                }
            ),
        }
        rows.append(row | {name: values[i] for name, values in columns.items()})
        truth.days.append(day)
        truth.logs.append(log)
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / 'results.parquet'
    before = [pd.read_parquet(path)] if path.exists() else []
    pd.concat([*before, pd.DataFrame(rows)], ignore_index=True).to_parquet(path)
    return truth
