"""How small a change a history finds, and how often it tells one that is none.

`python -m benchmarks.laboratory.change_sizes --actuators 40`. Two years of each, days drawn as the
laboratory's machines have them, no record simulated. In the second half one parameter is another
one by some of its own scatter of days; in the first nothing is.
"""

from __future__ import annotations

import argparse
import json
from datetime import date, timedelta
from pathlib import Path
from typing import Any

import numpy as np

from actuator_glue.campaigns.change_points import change_points
from actuator_glue.campaigns.series import Series
from benchmarks.laboratory.machines import DAY, MACHINES, NAMES, WALK

DAYS, BETWEEN = 250, 730.0 / 250.0
# What one test of the laboratory knows: median standard deviations of the logarithms.
KNOWN = np.array([0.001, 0.0014, 0.0012, 0.04])
# Of a change, in scatters of days; 0 for none.
SIZES = (0.0, 1.0, 2.0, 3.0, 5.0, 8.0)
_WEEK = 7.0


def drawn(size: float, number: int, seed: int) -> tuple[Series, int, int]:
    """Return the days of one actuator, before which of them it changed, and in which parameter."""
    rng = np.random.default_rng((seed, number, round(10 * size)))
    machine = MACHINES[number % len(MACHINES)]
    at, which = int(rng.integers(DAYS // 2, DAYS - 10)), number // len(MACHINES) % len(NAMES)
    times = np.round(BETWEEN * np.arange(DAYS))
    walked = np.cumsum(WALK * np.sqrt(BETWEEN) * rng.standard_normal((DAYS, len(NAMES))), axis=0)
    levels = np.log(machine.theta) + np.outer(times / 365.25, machine.drift) + walked
    levels[at:, which] += size * DAY[which]
    scatter = np.hypot(DAY, KNOWN) * rng.standard_normal(levels.shape)
    first = date(2024, 1, 8)
    days = tuple((first + timedelta(days=t)).isoformat() for t in times)
    covariance = np.broadcast_to(np.diag(KNOWN**2), (DAYS, len(NAMES), len(NAMES)))
    groups = tuple((day,) for day in days)
    series = Series(machine.name, days, times, NAMES, levels + scatter, covariance, groups, {})
    return series, at, which


def scored(size: float, actuators: int, seed: int) -> dict[str, Any]:
    """Return how many changes of a size were found within a week, and others that were told.

    Of those within a week also how many have their day in the 95 % interval.
    """
    found, inside, named, false, years = 0, 0, 0, 0, 0.0
    for number in range(actuators):
        series, at, which = drawn(size, number, seed)
        years += series.times[-1] / 365.25
        for change in change_points(series):
            if size and abs(series.times[change.place] - series.times[at]) <= _WEEK:
                found += 1
                inside += change.earliest <= series.days[at] <= change.latest
                named += NAMES[which] in change.moved
            else:
                false += 1
    return {
        'size': size,
        'actuators': actuators,
        'within_a_week': found,
        'inside_its_interval': inside,
        'right_parameter': named,
        'others': false,
        'years': years,
    }


def main() -> int:
    """Draw, look for changes, write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--actuators', type=int, default=40, help='of each size')
    parser.add_argument('--seed', type=int, default=1, help='of the days')
    parser.add_argument('--out', type=Path, default=Path('out/change_sizes'), help='folder')
    args = parser.parse_args()
    scores = [scored(size, args.actuators, args.seed) for size in SIZES]
    lines = [
        '| change, in scatters of days | within a week | its day in the 95 % interval '
        '| right parameter | others told a year |',
        '|---|---|---|---|---|',
    ]
    for s in scores:
        of = f'{s["within_a_week"]} of {s["actuators"]}' if s['size'] else '-'
        within, right = (
            s[name] if s['size'] else '-' for name in ('inside_its_interval', 'right_parameter')
        )
        others = s['others'] / s['years']
        lines.append(f'| {s["size"]:g} | {of} | {within} | {right} | {others:.3f} |')
    args.out.mkdir(parents=True, exist_ok=True)
    (args.out / 'change_sizes.json').write_text(json.dumps(scores, indent=1) + '\n')
    table = '\n'.join(lines) + '\n'
    (args.out / 'change_sizes.md').write_text(table)
    print(table)
    return 0


if __name__ == '__main__':
    raise SystemExit(main())
