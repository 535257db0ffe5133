"""A calibration as pictures and pages: bands over a record, the table of moments, the report."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from actuator_glue.api import tracking
from actuator_glue.api.calibration_data import CalibrationData
from actuator_glue.api.ensemble import evenly, simulated
from actuator_glue.inference.bands import band
from actuator_glue.inference.predictive import fit_residual, total_band
from actuator_glue.model.exact import Initial
from actuator_glue.model.structure import Structure
from actuator_glue.records import Record, source_name
from actuator_glue.report import html
from actuator_glue.report.posterior_figure import posterior_figure
from actuator_glue.report.timeseries import Bands, band_at_zooms, even_zooms

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LEVEL = 0.95
HEADER = ('parameter', 'unit', 'mean', 'sd', 'skew', 'COV', 'R-hat', 'ESS')


def bands_figure(found: CalibrationData, record: Record) -> tuple[Figure, float]:
    """Draw the parameter band and the total predictive band over a record.

    Returns:
        The figure, and the share of the record's samples inside the total 95 % band.

    Raises:
        InputError: the record's stiffness is not known.
    """
    structure = Structure(found.effects)
    count = len(structure.names)
    initial: Initial = 'rest' if found.initial == 'rest' else 'measured'
    moved = simulated(evenly(found.posterior), found.names, structure, record, initial)
    best = structure.simulate(found.best[:count], record, initial=initial)
    residual = fit_residual(record.measured - best, parameters=count)
    total = total_band(np.random.default_rng(0), moved, residual, (LEVEL,))
    inside = (record.measured >= total.lower[0]) & (record.measured <= total.upper[0])
    figure = band_at_zooms(
        record,
        Bands(band(moved, (LEVEL,)), total, level=LEVEL),
        even_zooms(record),
        title=source_name(record.source),
    )
    return figure, float(inside.mean())


def posterior(found: CalibrationData) -> Figure:
    """Draw every parameter's distribution and every pair of them."""
    units = [p.unit for p in found.parameters.values()]
    return posterior_figure(found.posterior, found.names, units)


def moment_rows(found: CalibrationData) -> list[tuple[str, ...]]:
    """Return a row of text for each parameter, under HEADER."""
    return [
        (
            name,
            p.unit,
            f'{p.mean:.5g}',
            f'{p.stddev:.3g}',
            f'{p.skewness:.2f}',
            f'{p.cov:.3g}',
            f'{p.rhat:.4f}',
            f'{p.ess:.0f}',
        )
        for name, p in found.parameters.items()
    ]


def moments_title(found: CalibrationData) -> str:
    """Return the title of the table of moments."""
    g = found.shaping_factor
    how = f'G = {g:.6g}' if g is not None else found.likelihood
    if found.automatic_shaping:
        how += ' (automatic)'
    force = ' and force' if found.force else ''
    return f'Posterior moments, {len(found.sources)} record(s){force}, {how}'


def error_line(found: CalibrationData) -> str:
    """Return the error of the best draw in one line."""
    share = found.error.nrmse
    percent = '-' if share is None else f'{100 * share:.2f} %'
    line = (
        f'error of the best draw: {1e3 * found.error.rms_m:.4g} mm rms, {percent} of the spread '
        'measured'
    )
    return line if found.structure is None else f'{line}; {found.structure.amounts()}'


def brief(found: CalibrationData) -> list[html.Block]:
    """Return problems, moments, error and notes."""
    blocks: list[html.Block] = [html.Note(line) for line in found.problems]
    blocks.append(html.Table(HEADER, moment_rows(found), moments_title(found)))
    blocks.append(html.Text(error_line(found)))
    blocks += tracking.tables(found.tracking)
    return [*blocks, *(html.Note(line) for line in found.notes)]


def page(found: CalibrationData) -> html.Page:
    """Return the report of a calibration."""
    picture = html.Picture.of(
        posterior(found), 'Distribution of each parameter, and of each pair.'
    )
    sections = [html.Section('Posterior', [*brief(found), picture])]
    if found.records:
        pictures = []
        for record in found.records:
            figure, inside = bands_figure(found, record)
            name = source_name(record.source) or 'a record'
            caption = (
                f'{name}: 95 % bands; the total one holds {100 * inside:.1f} % of the samples.'
            )
            pictures.append(html.Picture.of(figure, caption))
        sections.append(html.Section('Bands over the records', pictures))
    lead = '; '.join(found.problems) or error_line(found)
    made = f'{found.evaluations} evaluations, seed {found.seed}'
    return html.Page('Calibration', lead, sections, made)
