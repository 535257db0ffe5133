"""The page of an actuator that a laboratory manager reads: what changed, and what to do."""

from __future__ import annotations

import math
import os
from html import escape
from pathlib import Path
from typing import NamedTuple
from urllib.parse import quote

import numpy as np

from actuator_glue.campaigns import history_figures as figures
from actuator_glue.campaigns.change_points import A_YEAR
from actuator_glue.campaigns.effect_spells import EffectHistory
from actuator_glue.campaigns.history_data import HistoryData
from actuator_glue.model.parameters import BASE
from actuator_glue.report.html import Block, Note, Page, Picture, Section, Table, Text
from actuator_glue.report.quantity import plain, said, said_in, spread, word

# What stands behind a parameter that moved, for a mechanic.
_LOOK_AT = {
    'beta_1': 'the servo-valve: its response became another one',
    'alpha_1_beta_0': 'the gain of controller and valve: settings, supply pressure, valve',
    'alpha_2': 'the oil column: air in the oil, oil temperature, hoses, the stroke it works at',
    'alpha_3': 'leakage: piston seals, oil temperature, cross-port valves',
}
_NUMBERS = (
    ('delay_at_5_hz_s', 'delay at 5 Hz [ms]', 1e3),
    ('J2', 'J2 [%]', 100.0),
    ('error_after_m', 'error [um]', 1e6),
    ('noise_m', 'noise [um]', 1e6),
    ('margin_s', 'delay margin [ms]', 1e3),
    ('p_unstable', 'P(unstable)', 1.0),
)

_NAMED = 3  # outliers in the first lines, the last ones


def page(found: HistoryData, folder: Path) -> Page:
    """Return the page.

    Args:
        found: the history.
        folder: where it will be, for links to reports of tests.
    """
    return Page(
        f'Actuator {found.actuator}',
        lead(found),
        [
            Section('What changed', _changed(found)),
            Section('What to check', _check(found)),
            Section('What the next test will find', _next(found)),
            Section('Over the months', _months(found)),
            Section('Tests to look at', _look(found, folder)),
            Section('How to read this', _words(found)),
        ],
    )


def brief(found: HistoryData) -> list[Block]:
    """Return what a notebook shows: the history in a sentence, changes, effects, the next test."""
    return [Text(lead(found)), *_changed(found), *_next(found)]


def lead(found: HistoryData) -> str:
    """Return the history in a sentence or two."""
    series = found.series
    told = (
        f'{len(found.table)} tests on {len(series.days)} days from {series.days[0]} to '
        f'{series.days[-1]}'
    )
    left = len(series.left_out)
    told += f', {left} of them without numbers that count. ' if left else '. '
    if series.untold:
        told += (
            f'No test tells {", ".join(map(word, series.untold))}: each leaves that to the bounds '
            'of its prior, as tests of one stiffness alone do (`group` of the recipe calibrates '
            'tests of several together). '
        )
    if found.changes:
        listed = '; '.join(
            f'{c.day} ({", ".join(map(word, c.moved)) or "no parameter alone"})'
            for c in found.changes
        )
        one = len(found.changes) == 1
        told += f'{len(found.changes)} change{"" if one else "s"}: {listed}. '
    elif found.outliers:
        told += 'No change for good is seen. '
    else:
        told += 'Nothing points to a repair or a sudden fault. '
    if found.outliers:
        some = '; '.join(f'{o.group}: {o.reason}' for o in found.outliers[-_NAMED:])
        more = len(found.outliers) - _NAMED
        told += f'Out of line: {some}{f"; and {more} earlier" if more > 0 else ""}. '
    now = [e.name for e in found.effects if e.there]
    told += f'Now there: {", ".join(now)}.' if now else 'No effect beyond the model is there now.'
    gone = [
        f'{e.name} (last on {e.spells[-1].end}, {len(e.spells)} time{"s" * (len(e.spells) > 1)})'
        for e in found.effects
        if not e.there
    ]
    return told + (f' Came and went: {", ".join(gone)}.' if gone else '')


def _changed(found: HistoryData) -> list[Block]:
    rows = []
    for change in found.changes:
        sizes = found.change_sizes(change)
        said_ = [
            f'{word(n)} {100.0 * (r - 1.0):+.1f} % ({100.0 * (lo - 1.0):+.1f} to '
            f'{100.0 * (hi - 1.0):+.1f})'
            for n, (r, lo, hi) in sizes.items()
            if n in change.moved
        ]
        when = f'{change.earliest} to {change.latest}'
        rows.append(
            [change.day, when, f'{change.probability:.3f}', '; '.join(said_) or 'none alone']
        )
    blocks: list[Block] = []
    if rows:
        blocks.append(
            Table(
                ['first test after it', '95 % interval', 'probability', 'what moved, by how much'],
                rows,
                'Sudden changes of the level that days scatter around.',
                prose=True,
            )
        )
    else:
        blocks.append(Text('No sudden change is as likely as not.'))
    drift = _drift(found)
    if drift:
        last = ' since the last change' if found.changes else ''
        blocks.append(Text(f'Slowly{last}: {drift}.'))
    if found.effects:
        blocks.append(_effects(found.effects))
    return blocks


def _drift(found: HistoryData) -> str:
    """Return which levels moved since the last change, beyond their 95 % limits."""
    p, first = found.pooled, found.changes[-1].place if found.changes else 0
    told = []
    for i, name in enumerate(p.names):
        step = p.level[-1, i] - p.level[first, i]
        if abs(step) > 1.96 * math.hypot(p.level_stddev[-1, i], p.level_stddev[first, i]):
            told.append(
                f'{word(name)} {100.0 * np.expm1(step):+.1f} % since {found.series.days[first]}'
            )
    return ', '.join(told)


def _effects(effects: tuple[EffectHistory, ...]) -> Table:
    rows = []
    for e in effects:
        spells = '; '.join(
            s.begin if s.days == 1 else f'{s.begin} to {s.end} ({s.days} days of test)'
            for s in e.spells
        )
        sizes = '; '.join(f'{word(n)} {spread(m, lo, hi, u)}' for n, u, m, lo, hi in e.sizes)
        rows.append([e.name, spells, sizes or '-', f'{e.probability_next:.2f}'])
    return Table(
        ['effect', 'found on', 'size that one more test tells', 'P(next test finds it)'],
        rows,
        'Effects beyond Eq. (2) that diagnoses named.',
        prose=True,
    )


def _check(found: HistoryData) -> list[Block]:
    blocks: list[Block] = []
    if found.changes:
        last = found.changes[-1]
        blocks += [
            Note(
                f'Since {last.day}, {word(n)} is another one: look at {_LOOK_AT[n]}. If this was '
                'a repair, all is well.'
            )
            for n in last.moved
        ]
    blocks += [
        Note(
            f'{e.name} is there since {e.spells[-1].begin}'
            + (f' ({e.meaning})' if e.meaning else '')
            + f'. What to do: {e.remedy or "look for it before the next test"}.'
        )
        for e in found.effects
        if e.there
    ]
    failed = found.table[found.table['failure'] != '']
    if len(failed):
        blocks.append(
            Note(
                f'{len(failed)} of {len(found.table)} tests could not be used; the last section '
                'lists them.'
            )
        )
    return blocks or [Text('Nothing beyond the usual.')]


def _next(found: HistoryData) -> list[Block]:
    low, high = found.pooled.next_interval()
    middle = np.median(found.pooled.next_draws, axis=0)
    units = {p.name: p.unit for p in BASE}
    rows = [
        [
            word(name),
            said(middle[i], units[name], 4),
            f'{said(low[i], units[name], 4)} to {said(high[i], units[name], 4)}',
            f'{100.0 * found.pooled.offset[i]:.2g} %',
        ]
        for i, name in enumerate(found.pooled.names)
    ]
    table = Table(
        ['parameter', 'median', '95 % interval', 'scatter of days'],
        rows,
        f'Predicted for a test {found.pooled.ahead:g} days after the last one, unless the '
        'actuator is changed before. The command history writes it as a file for --prior.',
    )
    return [table]


def _months(found: HistoryData) -> list[Block]:
    blocks: list[Block] = [
        Picture.of(
            figures.levels(found),
            'Parameters of Eq. (2). Points: each day with its 95 % interval. Blue: the level, '
            'with its 95 % band. Dashed: changes.',
        )
    ]
    there = [c for c in _NUMBERS if c[0] in found.table or f'{c[0]}_mean' in found.table]
    sizes = []
    for name, unit, _, low, high in (size for e in found.effects for size in e.sizes):
        factor, people = said_in(unit, low, high)
        sizes.append((name, f'{word(name)} [{people or "-"}]', factor))
    if there:
        blocks.append(Picture.of(figures.numbers(found, there), 'How well it followed.'))
    if sizes:
        blocks.append(
            Picture.of(figures.numbers(found, sizes), 'Sizes of effects where they were found.')
        )
    return blocks


def _look(found: HistoryData, folder: Path) -> list[Block]:
    blocks: list[Block] = []
    if found.outliers:
        rows = [[o.group, o.reason, _link(found.folder, o.report, folder)] for o in found.outliers]
        blocks.append(Table(['test', 'why', 'report'], rows, 'Tests that stand out.', prose=True))
    else:
        blocks.append(Text('No test stands out.'))
    reported = found.table[found.table['failure'] == '']
    if 'report' in reported:
        rows = [
            [str(r['group']), str(r['effects'] or '-'), _link(found.folder, r['report'], folder)]
            for r in reported.to_dict('records')
            if isinstance(r['report'], str)
        ]
        if rows:
            blocks.append(Table(['test', 'effects', 'report'], rows, 'Diagnoses.', prose=True))
    failed = found.table[found.table['failure'] != '']
    if len(failed):
        rows = [[str(r['group']), str(r['failure'])] for r in failed.to_dict('records')]
        blocks.append(Table(['test', 'why'], rows, 'Tests without numbers.', prose=True))
    return blocks


class _Link(NamedTuple):
    """A link in a cell of a table; templates take its HTML as it is."""

    target: str

    def __html__(self) -> str:
        return f'<a href="{escape(quote(self.target))}">report</a>'


def _link(campaign: Path, report: str, folder: Path) -> _Link | str:
    return _Link(Path(os.path.relpath(campaign / report, folder)).as_posix()) if report else '-'


def _words(found: HistoryData) -> list[Block]:
    left = len(found.series.left_out)
    return [
        Text(
            'Each day has parameters of its own around a level that walks slowly and jumps where '
            'the actuator was changed. All days together tell how fast it walks, how far days '
            'scatter, and where it jumps; what each test knows counts with its posterior. A '
            f'change is told where its probability is at least one half, with {A_YEAR:g} expected '
            'in a year before anything is seen.'
        ),
        Text(
            f'{left} test(s) without numbers that hold are left out of this; '
            f'{plain(len(found.table) - left)} are in.'
        ),
    ]
