"""The page of a run: what was asked for beside what was measured, and every stream."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from actuator_glue.api.live import carriable
from benchmarks.live.cases import EFFECTS

Row = dict[str, Any]
# Of two sizes, the one that no tie excuses.
CLEAR = 4.0
# The truth, once proposed, is to keep so much weight.
KEPT = 0.05
# What nothing was measured of.
_NONE = 'none', '0 of 0'
# Streams of `--few`.
FEW = len(EFFECTS) + 2

HEAD = """# The live loop: what was measured

`python -m benchmarks.live` runs simulated streams of 120 s through the estimator and the live
diagnosis, joined as the nodes join them, without ROS: one of twelve effects, or a pair, at two
sizes (what a refitted Eq. (2) leaves of it is 2 or 4 times the sensor noise of 10 um), from the
start or from 45 s on; machines whose gain grows by 3 %; healthy ones; each with and without a
calibration to 1 %. Streams come in an order drawn by the seed, so that those that were run are a
fair sample of all. Windows have all the time that they want: no clock cuts them short. The
stream goes on while a diagnosis computes, for as long as that took of a processor.
What no stream of a commit could show is left out. Streams are listed that ended with another name
than the truth, that buried it below 5 % meanwhile, or whose intervals hold it in less than 80 %.
An offset of the sensor is nothing to add: the likelihood of a window takes the level out, Eq. (4).

Intervals are of the parameters of Eq. (2) that a window tells, not of those that the prior's
bounds do (`prior_dominated`). Half of the streams know a calibration; what no window tells of its
four parameters stays as it was drawn, inside its interval for the whole stream or outside. Each
window's prior is what those before it say: standard errors are of streams, as if each were one.

"""


def page(rows: Sequence[Row], cases: int, before: Sequence[Row] = ()) -> str:
    """Return the page of so many streams of `cases`, those of each commit by themselves.

    Args:
        rows: one a stream.
        cases: how many streams there are in all.
        before: rows of an earlier commit, told beside.
    """
    by_commit: dict[str, list[Row]] = {}
    for row in rows:
        by_commit.setdefault(str(row['commit']), []).append(row)
    parts = (_of_one(rows, at, cases, before) for at, rows in by_commit.items())
    return HEAD + '\n'.join(parts)


def _of_one(rows: Sequence[Row], commit: str, cases: int, before: Sequence[Row]) -> str:
    seeds = sorted(row['seed'] for row in rows)
    told = f'{len(rows)} of {cases} streams (seeds {seeds[0]} to {seeds[-1]}), commit {commit}.'
    if not any(row['effects'] for row in rows):
        told += ' Only machines that hide no effect (`--hidden nothing`).'
    elif len(rows) == FEW:
        told += ' Each effect once (`--few`).'
    elif 2 * sum(not row['effects'] for row in rows) > len(rows):
        told += ' Machines that hide no effect were run more often (`--hidden nothing`).'
    if before:
        earlier = sorted(row['seed'] for row in before)
        told += (
            f' Before: {len(before)} streams (seeds {earlier[0]} to {earlier[-1]}), '
            f'commit {before[0]["commit"]}.'
        )
    return f'## Commit {commit}\n\n{told}\n\n{_required(rows, before)}\n{_streams(rows)}'


def _required(rows: Sequence[Row], before: Sequence[Row]) -> str:
    """Return the table of what is required beside what was measured, and before."""
    earlier = {what: found for what, _, found in _measured(before)} if before else {}
    head = 'what', 'required', *(('before',) if before else ()), 'measured'
    lines = ['| ' + ' | '.join(head) + ' |', '|' + '---|' * len(head)]
    for what, wanted, found in _measured(rows):
        if found in _NONE:
            continue
        old = earlier.get(what, '')
        cells = what, wanted, *(('' if old in _NONE else old,) if before else ()), found
        lines.append('| ' + ' | '.join(cells) + ' |')
    return '\n'.join([*lines, ''])


def _measured(rows: Sequence[Row]) -> list[tuple[str, str, str]]:
    """Return what is asked for, what is required of it and what was measured."""
    hidden = [row for row in rows if carriable(row['effects'])]
    offset = [row for row in rows if row['effects'] and not carriable(row['effects'])]
    healthy = [row for row in rows if not row['effects'] and not row['drift']]
    drifting = [row for row in rows if not row['effects'] and row['drift']]
    clear = [row for row in hidden if row['ratio'] >= CLEAR]
    named = [row for row in hidden if np.isfinite(row['true_least'])]
    delays = [row['delay'] for row in hidden if np.isfinite(row['delay'])]
    # Rows of commits before this was counted have none.
    counted = [row for row in rows if 'worse' in row]
    looks = [seconds for row in rows for seconds in row['looks'] if np.isfinite(seconds)]
    in_turn = [[row['looks'][i] for row in rows if len(row['looks']) > i] for i in range(4)]
    in_turn = [some for some in in_turn if some]
    return [
        (
            'windows after the first addition whose 95 % intervals hold the truth',
            '93 to 97 %',
            _inside(hidden),
        ),
        (
            'windows of healthy machines whose 95 % intervals hold the truth',
            '93 to 97 %',
            _inside(healthy),
        ),
        (
            'windows of machines whose gain grows by 3 % whose 95 % intervals hold the truth',
            '',
            _inside(drifting),
        ),
        (
            'largest weight at the end is the truth, larger size',
            '90 %',
            _share([row['right'] for row in clear]),
        ),
        (
            'largest weight at the end is the truth, both sizes',
            '',
            _share([row['right'] for row in hidden]),
        ),
        (
            'the truth once proposed and then never below 5 %',
            'all',
            _share([row['true_least'] >= KEPT for row in named]),
        ),
        (
            'healthy machines without an addition',
            'all of 50',
            _share([not np.isfinite(row['added']) for row in healthy]),
        ),
        (
            'machines whose gain grows by 3 %, without an addition',
            '',
            _share([not np.isfinite(row['added']) for row in drifting]),
        ),
        (
            'machines whose sensor has an offset, without an addition',
            '',
            _share([not np.isfinite(row['added']) for row in offset]),
        ),
        (
            'first addition after the coverage broke, median',
            '15 s',
            f'{np.median(delays):.0f} s of {len(delays)}' if delays else 'none',
        ),
        (
            'samples in the 95 % bands of forecasts',
            '93 to 97 %',
            f'{np.mean([row["coverage"] for row in rows]):.1%}',
        ),
        (
            'streams in which an addition made forecasts worse for more than three windows',
            'none',
            f'{sum(row["worse"] > 3 for row in counted)} of {len(counted)}',
        ),
        (
            'processor time of a diagnosis, median',
            '',
            f'{np.median(looks):.0f} s of {len(looks)}' if looks else 'none',
        ),
        (
            'of the first, second, third, fourth of a stream, each of about twice as much data',
            '',
            ', '.join(f'{np.median(some):.0f} s of {len(some)}' for some in in_turn) or 'none',
        ),
    ]


def _inside(rows: Sequence[Row]) -> str:
    counted = sum(row['windows'] for row in rows)
    if not counted:
        return 'none'
    some = [row for row in rows if row['windows']]
    share = sum(row['inside'] * row['windows'] for row in some) / counted
    told = f'{share:.1%} of {counted} in {len(some)} streams'
    if len(some) < 2:
        return told
    # Windows of one stream know what those before it do: streams are independent, they are not.
    squares = sum((row['windows'] * (row['inside'] - share)) ** 2 for row in some)
    error = np.sqrt(squares * len(some) / (len(some) - 1.0)) / counted
    return f'{told} (standard error {error:.1%})'


def _share(true: Sequence[Any]) -> str:
    return f'{sum(map(bool, true))} of {len(true)}'


def _streams(rows: Sequence[Row]) -> str:
    hidden = [row for row in rows if row['effects']]
    if not hidden:
        return ''
    odd = [row for row in hidden if _odd(row)]
    told = f'\n{len(odd)} of {len(hidden)} did not end as one would wish:\n\n' if odd else ''
    return _by_effect(hidden) + told + (_each(odd) if odd else '')


def _odd(row: Row) -> bool:
    """Whether a stream is worth a look: another name, the truth buried, intervals off."""
    buried = row['true_least'] < KEPT  # NaN where it never was proposed
    return not row['right'] or buried or (row['windows'] > 0 and row['inside'] < 0.8)


def _by_effect(hidden: Sequence[Row]) -> str:
    """Return what came of the streams that hide the same."""
    head = 'hidden', 'streams', 'the truth leads', 'truth inside', 'first addition after the break'
    lines = ['| ' + ' | '.join(head) + ' |', '|' + '---|' * len(head)]
    by_name: dict[str, list[Row]] = {}
    for row in hidden:
        by_name.setdefault(' + '.join(row['effects']), []).append(row)
    for name, same in sorted(by_name.items()):
        delays = [row['delay'] for row in same if np.isfinite(row['delay'])]
        inside = _inside(same)
        cells = (
            name,
            str(len(same)),
            _share([row['right'] for row in same]) if carriable(same[0]['effects']) else '',
            '' if inside == 'none' else inside.partition(' (')[0],
            f'{np.median(delays):.0f} s' if delays else '',
        )
        lines.append('| ' + ' | '.join(cells) + ' |')
    return '\n'.join(lines) + '\n'


def _each(rows: Sequence[Row]) -> str:
    head = (
        'hidden',
        'ratio',
        'calibration',
        'from [s]',
        'coverage broke [s]',
        'first addition [s]',
        'truth inside',
        'weight of the truth at the end (least)',
        'largest weight at the end',
        'error/noise',
    )
    lines = ['| ' + ' | '.join(head) + ' |', '|' + '---|' * len(head)]
    for row in sorted(rows, key=lambda row: row['seed']):
        cells = (
            ' + '.join(row['effects']),
            f'{row["ratio"]:g}',
            'yes' if row['calibrated'] else 'no',
            f'{row["onset"]:g}',
            _number(row['broke']),
            _number(row['added']),
            f'{row["inside"]:.0%} of {row["windows"]}' if row['windows'] else '',
            f'{row["true_weight"]:.2f} ({row["true_least"]:.2f})',
            ' + '.join(row['leading']) or 'Eq. (2)',
            f'{row["error"]:.2f}',
        )
        lines.append('| ' + ' | '.join(cells) + ' |')
    return '\n'.join(lines) + '\n'


def _number(value: float) -> str:
    return f'{value:.0f}' if np.isfinite(value) else 'never'
