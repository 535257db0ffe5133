"""What few days of test tell: the next test within its interval, and which days are outliers.

`python -m benchmarks.laboratory.few_days --histories 100`. Days scatter as the laboratory's do
around a level that walks as its machines' do; no record is simulated. The scatter is normal, or
Student's t with four degrees of freedom and the same variance; or one day of normal ones is ten
scatters off in one parameter.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np

from actuator_glue.campaigns.day_left_out import left_out
from actuator_glue.campaigns.pooling import pooled
from actuator_glue.campaigns.series import Series
from actuator_glue.records import Array
from benchmarks.laboratory.change_sizes import BETWEEN, KNOWN
from benchmarks.laboratory.machines import DAY, MACHINES, NAMES, WALK

DAYS = (3, 5, 7, 12, 24)
KINDS = ('normal', 'heavy tails', 'one day off')
_OFF = 10.0  # scatters


def drawn(days: int, number: int, seed: int, kind: str) -> tuple[Series, Array]:
    """Return days of test of one machine, and its parameters at the next test (p,)."""
    rng = np.random.default_rng((seed, number, days))
    shape = days + 1, len(NAMES)
    steps = WALK * np.sqrt(BETWEEN) * rng.standard_normal(shape)
    scatter = rng.standard_normal(shape)
    if kind == 'heavy tails':
        scatter = rng.standard_t(4, shape) / np.sqrt(2.0)
    if kind == 'one day off':
        scatter[days // 2, number % len(NAMES)] += _OFF
    machine = MACHINES[number % len(MACHINES)]
    logs = np.log(machine.theta) + np.cumsum(steps, axis=0) + DAY * scatter
    told = (logs + KNOWN * rng.standard_normal(shape))[:days]
    names = tuple(f'day {i + 1}' for i in range(days))
    covariance = np.broadcast_to(np.diag(KNOWN**2), (days, len(NAMES), len(NAMES)))
    groups = tuple((name,) for name in names)
    times = np.round(BETWEEN * np.arange(days))
    series = Series(machine.name, names, times, NAMES, told, covariance, groups, {})
    return series, np.exp(logs[-1])


def scored(days: int, kind: str, histories: int, seed: int) -> dict[str, Any]:
    """Return how many intervals of the next test hold, and which days were told as outliers."""
    inside, any_told, right = 0, 0, 0
    for number in range(histories):
        series, following = drawn(days, number, seed, kind)
        together = pooled(series)
        low, high = together.next_interval()
        inside += int(((low <= following) & (following <= high)).sum())
        told = left_out(series, together).outliers
        any_told += bool(told.any())
        right += bool(told[days // 2] and told.sum() == 1)
    of = histories * len(NAMES)
    return {
        'days': days,
        'kind': kind,
        'histories': histories,
        'next_test_inside': inside / of,
        'with_an_outlier': any_told,
        'the_middle_day_alone': right,
    }


def main() -> int:
    """Draw, judge, write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--histories', type=int, default=100, help='of each kind')
    parser.add_argument('--seed', type=int, default=1, help='of the days')
    parser.add_argument('--out', type=Path, default=Path('out/few_days'), help='folder')
    args = parser.parse_args()
    scores = {
        (days, kind): scored(days, kind, args.histories, args.seed)
        for days in DAYS
        for kind in KINDS
    }
    lines = [
        '| days | next test inside its 95 % interval | an outlier is told | of days with heavy '
        'tails | the day that is ten scatters off, alone |',
        '|---|---|---|---|---|',
    ]
    for days in DAYS:
        plain, heavy, off = (scores[days, kind] for kind in KINDS)
        lines.append(
            f'| {days} | {100.0 * plain["next_test_inside"]:.1f} % '
            f'| {plain["with_an_outlier"]} of {args.histories} '
            f'| {heavy["with_an_outlier"]} of {args.histories} '
            f'| {off["the_middle_day_alone"]} of {args.histories} |'
        )
    args.out.mkdir(parents=True, exist_ok=True)
    (args.out / 'few_days.json').write_text(json.dumps([*scores.values()], indent=1) + '\n')
    table = '\n'.join(lines) + '\n'
    (args.out / 'few_days.md').write_text(table)
    print(table)
    return 0


if __name__ == '__main__':
    raise SystemExit(main())
