"""What a campaign and its histories say of the simulated laboratory, beside the truth."""

from __future__ import annotations

import json
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np

from actuator_glue.api.calibration import calibrate
from actuator_glue.campaigns.actuator_history import ActuatorHistory, history
from actuator_glue.campaigns.change_points import change_points
from actuator_glue.campaigns.grouping import tasks_of
from actuator_glue.campaigns.pooling import Pooled, pooled
from actuator_glue.campaigns.recipe import read_recipe
from actuator_glue.campaigns.rows import read_results
from actuator_glue.campaigns.series import actuators_of
from benchmarks.laboratory.machines import NAMES

WEEK = 7  # days
# The next test is predicted from so many days of test on, then every so many.
_FIRST, _EVERY = 12, 5

Json = dict[str, Any]


def judge(folder: Path, with_prior: int) -> Json:
    """Return the scores of a campaign over the files of `simulate`.

    Args:
        folder: with `truth.json`, `recipe.yaml`, `records` and the campaign in `out`.
        with_prior: tests that are calibrated once more, with the prior of the days before.
    """
    truth = json.loads((folder / 'truth.json').read_text('utf-8'))
    table = read_results(folder / 'out')
    found = [history(folder / 'out', name) for name in actuators_of(table)]
    good = table[table['failure'] == '']
    rows = good.to_dict('records')
    ahead = [one for h in found for one in _predicted(h, truth)]
    return {
        'records': truth['records'],
        'groups': len(table),
        'seconds_per_group': {
            verdict: [len(of), float(of.median())]
            for verdict, of in good.groupby('verdict')['seconds']
        },
        'broken_files': len(truth['broken']),
        'broken_told': sum(_told(table, entry['group']) for entry in truth['broken'].values()),
        'sound_groups_failed': int(
            (~table.loc[table['failure'] != '', 'group'].isin(_broken(truth))).sum()
        ),
        'effects': _effects(rows, truth),
        'changes': _changes(found, truth),
        'test_intervals': _share([_holds(row, truth) for row in rows if row['verdict'] != '?']),
        'pooled_intervals': _share(
            [
                _inside(h.pooled.interval(i), truth['tests'][g[0]]['theta'])
                for h in found
                for i, g in enumerate(h.series.groups)
            ]
        ),
        'next_test': _share([inside for _, _, _, inside in ahead]),
        'next_test_days': len(ahead),
        'with_prior': _with_prior(folder, ahead, truth, with_prior),
    }


def _broken(truth: Json) -> set[str]:
    return {entry['group'] for entry in truth['broken'].values()}


def _told(table: Any, group: str) -> bool:
    """Whether the row of a group with a broken file says that something is wrong."""
    row = table[table['group'] == group]
    if not len(row):
        return False
    one = row.iloc[0]
    problems = one.get('problems')
    return bool(
        one['failure']
        or (isinstance(problems, str) and problems)
        or one['verdict'] not in ('none', 'missing-effect')
    )


def _share(inside: list[list[bool]]) -> Json:
    every = np.array(inside, dtype=bool)
    return {
        'of': int(every.size),
        'share': float(every.mean()) if every.size else None,
        'by_parameter': dict(zip(NAMES, every.mean(axis=0).tolist(), strict=True))
        if every.size
        else {},
    }


def _inside(interval: tuple[np.ndarray, np.ndarray], theta: Json) -> list[bool]:
    low, high = interval
    return [bool(low[i] <= theta[n] <= high[i]) for i, n in enumerate(NAMES)]


def _holds(row: Json, truth: Json) -> list[bool]:
    theta = truth['tests'][row['group']]['theta']
    return [bool(row[f'{n}_lower'] <= theta[n] <= row[f'{n}_upper']) for n in NAMES]


def _effects(rows: list[Json], truth: Json) -> Json:
    out = {'there': 0, 'named': 0, 'something_said': 0, 'absent': 0, 'false': 0}
    for row in rows:
        true = set(truth['tests'][row['group']]['effects'])
        said = {n for n in str(row['effects'] or '').split('; ') if n}
        tied = set(str(row.get('alternatives') or '').replace('; ', ', ').split(', '))
        if true:
            out['there'] += 1
            out['named'] += bool(true & (said | tied))
            out['something_said'] += row['verdict'] != 'none'
        else:
            out['absent'] += 1
            out['false'] += bool(said)
    return out


def _changes(found: list[ActuatorHistory], truth: Json) -> Json:
    """Count events found within a week, and changes of which there was none."""
    left = list(truth['events'])
    false, off = 0, []
    years = sum(h.series.times[-1] for h in found) / 365.25
    for h in found:
        for change in h.changes:
            days = {
                i: abs((date.fromisoformat(change.day) - date.fromisoformat(e['day'])).days)
                for i, e in enumerate(left)
                if e['actuator'] == h.actuator
            }
            near = min(days, key=days.__getitem__, default=None)
            if near is not None and days[near] <= WEEK:
                off.append(days[near])
                del left[near]
            else:
                false += 1
    return {
        'events': len(truth['events']),
        'within_a_week': len(off),
        'days_off': off,
        'false': false,
        'actuator_years': float(years),
        'false_per_actuator_year': float(false / years),
    }


def _predicted(h: ActuatorHistory, truth: Json) -> list[tuple[str, str, Pooled, list[bool]]]:
    """Return what was known of later days from the days before them, repairs left out."""
    out = []
    events = {e['day'] for e in truth['events'] if e['actuator'] == h.actuator}
    for cut in range(_FIRST, len(h.series.days), _EVERY):
        before, day = h.series.until(cut), h.series.days[cut]
        if any(before.days[-1] < event <= day for event in events):
            continue  # nobody foresees a repair
        gap = float(h.series.times[cut] - h.series.times[cut - 1])
        known = pooled(before, change_points(before), gap)
        group = h.series.groups[cut][0]
        inside = _inside(known.next_interval(), truth['tests'][group]['theta'])
        out.append((h.actuator, group, known, inside))
    return out


def _with_prior(
    folder: Path, ahead: list[tuple[str, str, Pooled, list[bool]]], truth: Json, count: int
) -> Json:
    """Calibrate some tests with and without the prior of the days before them."""
    from actuator_glue.api.pooled_prior import PooledPrior

    tasks = {
        t.group: t for t in tasks_of([folder / 'records'], read_recipe(folder / 'recipe.yaml'))
    }
    sound = [a for a in ahead if not truth['tests'][a[1]]['effects']]
    chosen = sound[:: max(len(sound) // max(count, 1), 1)][:count]
    both, one, inside = [], [], []
    for _, group, known, _ in chosen:
        path = folder / 'prior.npz'
        PooledPrior(known.names, known.next_draws, group).save(path)
        theta = truth['tests'][group]['theta']
        tests = [r for m in tasks[group].members for r in m.records()]
        for some, widths in ((tests, both), (tests[:1], one)):
            alone = calibrate(some, evaluations=12_000)
            told = calibrate(some, evaluations=12_000, prior=path)
            a, b = (np.quantile(c.posterior, (0.025, 0.975), axis=0) for c in (alone, told))
            widths.append(((a[1] - a[0]) / (b[1] - b[0])).tolist())
            inside.append(_inside((b[0], b[1]), theta))
    return {
        'tests': len(chosen),
        'narrower_two_stiffnesses': _medians(both),
        'narrower_one_stiffness': _medians(one),
        'intervals': _share(inside),
    }


def _medians(widths: list[list[float]]) -> Json:
    if not widths:
        return {}
    return dict(zip(NAMES, np.median(widths, axis=0).tolist(), strict=True))


def text(scores: Json, how: Json) -> str:
    """Return the scores as a table of Markdown, what was required beside what was measured."""
    c, e, p = scores['changes'], scores['effects'], scores['with_prior']

    def percent(of: Json) -> str:
        return 'none' if of['share'] is None else f'{100 * of["share"]:.1f} % of {of["of"]}'

    def factors(of: Json) -> str:
        return ', '.join(f'{v:.2f}' for v in of.values()) or 'none'

    rows = [
        ('records, groups', '2000 records', f'{scores["records"]}, {scores["groups"]}'),
        ('groups an hour and core', 'stated', f'{how["groups_per_hour"]:.0f}'),
        ('records an hour and core', 'stated', f'{how["records_per_hour"]:.0f}'),
        ('broken files told', 'all', f'{scores["broken_told"]} of {scores["broken_files"]}'),
        ('groups without a broken file that failed', '0', str(scores['sound_groups_failed'])),
        ('changes found within a week', 'all', f'{c["within_a_week"]} of {c["events"]}'),
        (
            'false changes per actuator-year',
            '<= 1',
            f'{c["false_per_actuator_year"]:.2f} in {c["actuator_years"]:.1f} years',
        ),
        ('95 % intervals of single tests', '-', percent(scores['test_intervals'])),
        ('95 % pooled intervals', '92 to 98 %', percent(scores['pooled_intervals'])),
        ('95 % intervals of the next test', '92 to 98 %', percent(scores['next_test'])),
        ('the same after calibrating with the prior', '-', percent(p['intervals'])),
        (
            'narrower with the prior, free and clamped',
            'stated',
            factors(p['narrower_two_stiffnesses']),
        ),
        ('narrower with the prior, one test', 'stated', factors(p['narrower_one_stiffness'])),
        ('days with an effect: named', '-', f'{e["named"]} of {e["there"]}'),
        ('days without: an effect named', '-', f'{e["false"]} of {e["absent"]}'),
    ]
    lines = [' | '.join(row) for row in (('', 'required', 'measured'), ('---',) * 3, *rows)]
    return '\n'.join(f'| {line} |' for line in lines) + '\n'
