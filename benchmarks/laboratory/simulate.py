"""Two years of tests of four machines as files, and the truth apart from them."""

from __future__ import annotations

import json
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np

from benchmarks.laboratory.files import BROKEN, FORMATS, LOGGERS, break_file
from benchmarks.laboratory.machines import (
    DAY,
    MACHINES,
    NAMES,
    STIFFNESS,
    WALK,
    Machine,
    command,
    measured,
)

BEGIN = datetime(2024, 1, 8, 9)
# 2000 records of four machines, two a day of test: 250 days in two years.
BETWEEN = 730.0 / 250.0
BROKEN_SHARE = 0.01
RECIPE = r"""# Two tests of a day, free and clamped, are calibrated together.
names: '(?P<actuator>[a-z]+)_(?P<started>\d{8}T\d{6})_(?P<specimen>[a-z]+)\.'
group: [actuator, day]
files:
  - {match: '*_free.*', stiffness: 0}
  - {match: '*_clamped.*', stiffness: 250e3}
  - match: '*.asc'  # text of the controller: 3 lines, semicolons, decimal commas, 2 mm/V
    channels:
      command: {column: 1, unit: mm, scale: 2.0}
      measured: {column: 2, unit: mm, scale: 2.0}
      rate: 200
      header_lines: 3
      delimiter: ';'
      decimal: ','
calibrate: {evaluations: 12000}
diagnose: structure
seconds: 900
"""


def simulate(folder: Path, records: int, seconds: float, seed: int) -> dict[str, object]:
    """Write the files of a laboratory and their recipe; return the truth, which is written, too.

    Fewer records are a shorter time at the same pace.

    Args:
        folder: where to; the truth goes to `truth.json` in it, the files below `records`.
        records: how many, of all machines.
        seconds: length of each.
        seed: of everything.
    """
    days = max(records // (2 * len(MACHINES)), 1)
    truth: dict[str, object] = {'records': 0, 'broken': {}, 'tests': {}, 'events': []}
    for number, machine in enumerate(MACHINES):
        _tests(folder, machine, days, seconds, np.random.default_rng((seed, number)), truth)
    (folder / 'recipe.yaml').write_text(RECIPE)
    (folder / 'truth.json').write_text(json.dumps(truth, indent=1))
    return truth


def _tests(
    folder: Path,
    machine: Machine,
    days: int,
    seconds: float,
    rng: np.random.Generator,
    truth: dict,
) -> None:
    walked, repaired = np.zeros(len(NAMES)), False
    (folder / 'records' / machine.name).mkdir(parents=True, exist_ok=True)
    for day in range(days):
        share = day / days
        at = BEGIN + timedelta(days=round(day * BETWEEN), minutes=int(rng.integers(240)))
        walked = walked + WALK * np.sqrt(BETWEEN) * rng.standard_normal(len(NAMES))
        level = np.log(machine.theta) + walked
        level = level + np.array(machine.drift) * day * BETWEEN / 365.25
        if machine.repair is not None and share >= machine.repair[0]:
            level = level + np.array(machine.repair[1])
            if not repaired:
                truth['events'].append(
                    {
                        'actuator': machine.name,
                        'day': at.date().isoformat(),
                        'moved': [n for n, v in zip(NAMES, machine.repair[1], strict=True) if v],
                    }
                )
            repaired = True
        theta = np.exp(level + DAY * rng.standard_normal(len(NAMES)))
        effect = None
        if machine.effect is not None:
            kind, size, times = machine.effect
            if any(a <= share < b for a, b in times):
                effect = (kind, size)
        group = f'{machine.name}/{at.date().isoformat()}'
        truth['tests'][group] = {
            'theta': dict(zip(NAMES, theta.tolist(), strict=True)),
            'level': dict(zip(NAMES, np.exp(level).tolist(), strict=True)),
            'effects': [] if effect is None else [effect[0]],
            'size': None if effect is None else effect[1],
        }
        suffix, write = FORMATS[LOGGERS[machine.name][share >= 0.5]]
        for minutes, (specimen, k) in enumerate(STIFFNESS.items()):
            u = command(specimen, seconds, rng)
            x = measured(u, theta, k, effect, rng)
            stamp = (at + timedelta(minutes=10 * minutes)).strftime('%Y%m%dT%H%M%S')
            name = f'{machine.name}/{machine.name}_{stamp}_{specimen}{suffix}'
            path = folder / 'records' / name
            truth['records'] += 1
            if rng.random() < BROKEN_SHARE:
                kind = BROKEN[int(rng.integers(len(BROKEN)))]
                break_file(path, kind, write, u, x, rng)
                truth['broken'][name] = {'kind': kind, 'group': group}
            else:
                write(path, u, x)
