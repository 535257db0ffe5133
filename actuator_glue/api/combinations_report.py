"""What holds without a stiffness, as pages and pictures: in the order of every calibration."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from actuator_glue.api.calibration_report import (
    PANELS,
    before_after,
    certainty,
    delays,
    errors,
    first_sections,
    in_brief,
    residuals,
    verdict,
)
from actuator_glue.api.combinations_data import COMBINATIONS, CombinationsData
from actuator_glue.inference.at_bound import pressed
from actuator_glue.inference.convergence import APART
from actuator_glue.model.structure import Structure
from actuator_glue.records import source_names
from actuator_glue.report import html
from actuator_glue.report.first_page import FirstPage, command
from actuator_glue.report.posterior_figure import posterior_figure
from actuator_glue.report.residual_figure import Left

if TYPE_CHECKING:
    from matplotlib.figure import Figure

HEADER = ('combination', 'unit', 'mean', 'sd', 'R-hat')
TITLE = 'b, a and c of x/u = b / (s^2 + a s + b + c), Eq. (2), and effects'
_LETTERS = ('b', 'a', 'c')
_FAR = 100.0  # times the largest draw: no bound of a combination


def figure(found: CombinationsData) -> Figure:
    """Draw the distribution of each combination, and each pair of them."""
    units = [p.unit for p in found.combinations.values()]
    rest = list(found.combinations)[len(COMBINATIONS) :]
    return posterior_figure(found.posterior, (*_LETTERS, *rest), units)


def moments(found: CombinationsData) -> html.Table:
    """Return the table of what is known of each combination."""
    rows = [
        (name, p.unit, f'{p.mean:.5g}', f'{p.stddev:.3g}', f'{p.rhat:.4f}')
        for name, p in found.combinations.items()
    ]
    return html.Table(HEADER, rows, TITLE)


def first_page(found: CombinationsData, *, drawn: bool = True) -> FirstPage:
    """Return what a person is told first.

    Args:
        found: what is known.
        drawn: with a picture, where the records are known.
    """
    return FirstPage(
        (*verdict(found.problems, found.error, found.structure), found.notes[0]),
        certainty(found.combinations, found.posterior, _at_zero(found), found.problems),
        residuals(_left(found)) if drawn and found.residuals else None,
        errors(found.error, found.structure),
        _parameters(found),
        delays(found.tracking),
        command=next_command(found),
    )


def _at_zero(found: CombinationsData) -> list[str]:
    draws = found.posterior
    low = np.array([p.bounds[0] for p in found.combinations.values()])
    high = np.array([p.bounds[1] for p in found.combinations.values()])
    high = np.where(np.isfinite(high), high, _FAR * np.abs(draws).max(axis=0))
    return [p.name for p in pressed(draws, tuple(found.combinations), low, high) if p.physical]


def _left(found: CombinationsData) -> list[Left]:
    noise = None if found.structure is None else found.structure.noise_m
    out = []
    called = source_names(record.source for record in found.records)
    for record, error in list(zip(found.records, found.residuals, strict=True))[:PANELS]:
        title = f'{called[record.source] or "record"}: k not known'
        out.append(Left(title, record.time[len(record) - len(error) :], error, noise))
    return out


def _parameters(found: CombinationsData) -> html.Table:
    meanings = {p.name: p.meaning for p in Structure(found.effects).parameters}
    letters = zip(COMBINATIONS, _LETTERS, strict=True)
    meanings |= {name: f'{letter} of the transfer function' for name, letter in letters}
    return before_after(found.combinations, found.posterior, meanings)


def next_command(found: CombinationsData) -> str:
    """Return what to type next: with a stiffness, or of a free actuator."""
    tests = [(s.source, None) for s in found.sources]
    effects = [text for name in found.effects for text in ('--effect', name)]
    if any(not p.rhat <= APART for p in found.combinations.values()):
        more = ['--evaluations', str(2 * found.evaluations)]
        return command('calibrate', tests, '--stiffness', 'unknown', *effects, *more)
    if found.pull is not None:
        known = [(source, float(f'{found.pull:.3g}')) for source, _ in tests]
        return command('calibrate', known, *effects)
    return command('calibrate', [('FREE.csv', 0.0)], *effects)


def brief(found: CombinationsData) -> list[html.Block]:
    """Return problems, combinations, error and what they cost."""
    return in_brief(found, moments(found))


def page(found: CombinationsData, next_command: str = '') -> html.Page:
    """Return the report: the answer, the posterior, and how the actuator follows its command.

    Args:
        found: what is known.
        next_command: what to type next; empty for a command over the same files.
    """
    first = first_page(found).ending_with(next_command)
    picture = html.Picture.of(figure(found), 'Distribution of each combination; b, a, c as above.')
    known: list[html.Block] = [moments(found), picture, *map(html.Note, found.notes[1:])]
    sections = first_sections(first, known, found.tracking)
    made = f'{found.evaluations} evaluations'
    return html.Page('Calibration without a stiffness', first.verdict[0], sections, made)
