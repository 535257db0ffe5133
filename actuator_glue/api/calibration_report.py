"""A calibration as pictures and pages: bands over a record, the table of moments, the report."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from actuator_glue.api import tracking
from actuator_glue.api.calibration_data import CalibrationData
from actuator_glue.api.calibration_error import best_residuals
from actuator_glue.api.calibration_parts import FitError, Marginal
from actuator_glue.api.combinations_data import CombinationsData
from actuator_glue.api.drawn import evenly
from actuator_glue.api.ensemble import simulated
from actuator_glue.diagnosis.verdict.residual_structure import ResidualStructure
from actuator_glue.inference.bands import band
from actuator_glue.inference.convergence import APART
from actuator_glue.inference.predictive import fit_residual, total_band
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array, Record, source_name, source_names
from actuator_glue.report import html
from actuator_glue.report.first_page import FirstPage, command
from actuator_glue.report.posterior_figure import posterior_figure
from actuator_glue.report.quantity import plain, said_in, spread, word
from actuator_glue.report.residual_figure import Left, residual_figure
from actuator_glue.report.timeseries import Bands, band_at_zooms, even_zooms
from actuator_glue.report.worst import chosen, worst

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LEVEL = 0.95
PANELS = 4  # records in the first picture
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
    moved = simulated(evenly(found.posterior), found.names, structure, record, found.initial)
    best = structure.simulate(found.best[:count], record, initial=found.initial)
    residual = fit_residual(record.measured - best, parameters=count)
    total = total_band(np.random.default_rng(0), moved, residual, (LEVEL,))
    inside = (record.measured >= total.lower[0]) & (record.measured <= total.upper[0])
    figure = band_at_zooms(
        record,
        Bands(band(moved, (LEVEL,)), total, level=LEVEL),
        even_zooms(record),
        title=_called(found, record),
    )
    return figure, float(inside.mean())


def _called(found: CalibrationData, record: Record) -> str:
    """Return what people read as the name of a record, beside those that were calibrated with."""
    return source_names([record.source, *(s.source for s in found.sources)])[record.source]


def posterior(found: CalibrationData) -> Figure:
    """Draw every parameter's distribution and every pair of them."""
    units = [p.unit for p in found.parameters.values()]
    return posterior_figure(found.posterior, found.names, units)


def moments(found: CalibrationData) -> html.Table:
    """Return the table of moments."""
    rows = [
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
    g = found.shaping_factor
    how = f'G = {g:.6g}' if g is not None else found.likelihood
    if found.automatic_shaping:
        how += ' (automatic)'
    force = ' and force' if found.force else ''
    title = f'Posterior moments, {len(found.sources)} record(s){force}, {how}'
    return html.Table(HEADER, rows, title)


def error_line(error: FitError, left: ResidualStructure | None) -> str:
    """Return the error of the best draw in one line."""
    share = error.nrmse
    percent = '-' if share is None else f'{100 * share:.2f} %'
    line = (
        f'error of the best draw: {1e3 * error.rms_m:.4g} mm rms, {percent} of the spread measured'
    )
    return line if left is None else f'{line}; {left.amounts()}'


def verdict(
    problems: Sequence[str], error: FitError, left: ResidualStructure | None
) -> tuple[str, ...]:
    """Return why a posterior must not be used, or that the model fits."""
    return tuple(problems) or (f'the model fits: {error_line(error, left)}',)


def residuals(left: Sequence[Left]) -> html.Picture:
    """Draw what the best draw leaves of each record."""
    return html.Picture.of(
        residual_figure(left),
        'What the best draw leaves of each record; grey is noise, which no model explains.',
        residual_figure(left, narrow=True),
    )


def first_page(found: CalibrationData, hybrid: str = '', *, drawn: bool = True) -> FirstPage:
    """Return what a person is told first.

    Args:
        found: the calibration.
        hybrid: what it means for a hybrid test.
        drawn: with a picture, where the records are known, and symbols for names; on a terminal
            neither.
    """
    return FirstPage(
        verdict(found.problems, found.error, found.structure),
        certainty(
            found.parameters,
            found.posterior,
            [p.name for p in found.at_bound if p.physical],
            found.problems,
            word if drawn else str,
        ),
        residuals(_left(found)) if drawn and found.records else None,
        errors(found.error, found.structure),
        _parameters(found, word if drawn else str),
        delays(found.tracking),
        (),
        hybrid,
        next_command(found),
    )


def certainty(
    parameters: Mapping[str, Marginal],
    draws: Array,
    at_zero: Sequence[str],
    problems: Sequence[str],
    name: Callable[[str], str] = str,
) -> str:
    """Return the widest interval over its mean, and what that is.

    Args:
        parameters: posterior of each.
        draws: shape (m, p), in their order.
        at_zero: parameters that lie at zero, where nothing is below.
        problems: why the posterior must not be used.
        name: what a parameter is called.
    """
    if problems:
        return 'not at all, as long as that stands: the intervals are those of a wrong model'
    ends = np.quantile(draws, (0.025, 0.975), axis=0).T
    shares = {
        n: 50.0 * (high - low) / abs(p.mean)
        for (n, p), (low, high) in zip(parameters.items(), ends, strict=True)
        if p.mean and n not in at_zero
    }
    worst = max(shares, key=shares.__getitem__)
    rest = f' ({", ".join(map(name, at_zero))} aside, of which the most is known)'
    return (
        f'+-{plain(shares[worst], 2)} % is the widest interval, that of {name(worst)} (half of '
        f'its 95 % interval over its mean){rest if at_zero else ""}'
    )


def errors(error: FitError, left: ResidualStructure | None) -> html.Table:
    """Return the error before and after, and what it is made of."""
    rows = []
    if left is not None:
        rows.append(['before: the command itself, no model', f'{1e6 * left.command_rms_m:.1f}'])
    rows.append(['after: the best draw', f'{1e6 * error.rms_m:.1f}'])
    if len(error.records) > 1:
        called = source_names(of.source for of in error.records)
        for of in error.records:
            name = called[of.source] or 'a record'
            rows.append([f'... in {name}', f'{1e6 * of.rms_m:.1f}'])
    if left is not None:
        means = left.averaged and f',{left.averaged}'
        rows.append([f'structure in it{means}', f'{1e6 * left.structure_m:.1f}'])
        rows.append([f'noise{means}', f'{1e6 * left.noise_m:.1f}'])
    return html.Table(['', 'rms [um]'], rows, 'Measured displacement less the model.')


def _parameters(found: CalibrationData, name: Callable[[str], str]) -> html.Table:
    meanings = {p.name: p.meaning for p in Structure(found.effects).parameters}
    known = '' if found.prior is None else f', and what {source_name(found.prior.source)} knew'
    return before_after(found.parameters, found.posterior, meanings, known, name)


def before_after(
    parameters: Mapping[str, Marginal],
    draws: Array,
    meanings: Mapping[str, str],
    known: str = '',
    name: Callable[[str], str] = str,
) -> html.Table:
    """Return what was known of each parameter before, and what is known by its draws.

    Args:
        parameters: posterior of each.
        draws: shape (m, p), in their order.
        meanings: what they are.
        known: what else than bounds was known.
        name: what a parameter is called.
    """
    ends = np.quantile(draws, (0.025, 0.975), axis=0).T
    rows = []
    for (n, p), (low, high) in zip(parameters.items(), ends, strict=True):
        before = 'not negative'
        if np.isfinite(p.bounds[1]):
            factor, unit = said_in(p.unit, *p.bounds)
            limits = (plain(factor * bound) for bound in p.bounds)
            before = f'{" to ".join(limits)} {unit}'.rstrip()
        after = spread(p.mean, float(low), float(high), p.unit)
        after += ', little more than its prior' if p.prior_dominated else ''
        rows.append([name(n), meanings.get(n, ''), before, after])
    header = ['parameter', 'what it is', 'before', 'after']
    caption = f'Parameters before (bounds{known}) and after (means, 95 % intervals).'
    return html.Table(header, rows, caption, prose=True)


def delays(tracked: Sequence[tracking.RecordTracking]) -> str:
    """Return the delay in each record in a line; empty where it is not known."""
    told = []
    for of in tracked:
        known = (('delay_at_5_hz_s', ' at 5 Hz'), ('fei_delay_s', ' over the record'))
        for key, where in known:
            if key in of.predicted:
                d = of.predicted[key]
                told.append(f'{spread(d.median, d.lower, d.upper, "s")}{where} in {of.source}')
                break
    return '; '.join(told)


def next_command(found: CalibrationData) -> str:
    """Return what to type next."""
    tests = [(s.source, s.stiffness_n_per_m) for s in found.sources]
    effects = [text for name in found.effects for text in ('--effect', name)]
    left = found.structure
    apart = any(not p.rhat <= APART for p in found.parameters.values())
    pressed = [p for p in found.at_bound if not p.physical]
    if apart:
        more = ['--evaluations', str(2 * found.evaluations)]
        return command('calibrate', tests, *effects, *more)
    if left is not None and left.setup is not None:
        setup = left.setup
        tests = list(zip(setup.sources, setup.stiffness, strict=True))
        return command('calibrate', tests, *effects, *setup.options())
    if left is not None and left.other_fits:
        return command('calibrate', tests, *effects, '--hold', left.other_hold)
    # With any other problem, a wider bound would only fit what is wrong.
    only_pressed = 0 < len(pressed) == len(found.problems)
    if only_pressed and left is not None and left.intervals_hold:
        wider = []
        for p in pressed:
            low, high = found.parameters[p.name].bounds
            span = high - low
            low, high = (low - span, high) if p.side == 'lower' else (low, high + span)
            wider += ['--bounds', f'{p.name}={low:g}:{high:g}']
        return command('calibrate', tests, *effects, *wider)
    if found.problems or not found.effects:
        return command('diagnose', tests, '--report', 'report.html')
    return command('calibrate', tests, *effects, '--save', 'posterior.npz')


def _left(found: CalibrationData) -> list[Left]:
    noise = None if found.structure is None else found.structure.noise_m
    out = []
    for record, error in zip(found.records, best_residuals(found, PANELS), strict=False):
        k = f'k = {record.known_stiffness() / 1e3:g} kN/m'
        title = f'{_called(found, record) or "record"}: {k}'
        out.append(Left(title, record.time[-len(error) :], error, noise))
    return out


def brief(found: CalibrationData) -> list[html.Block]:
    """Return problems, moments, error and notes."""
    return in_brief(found, moments(found))


def in_brief(found: CalibrationData | CombinationsData, table: html.Table) -> list[html.Block]:
    """Return problems, the table of what is known, error, tracking and notes."""
    return [
        *map(html.Note, found.problems),
        table,
        html.Text(error_line(found.error, found.structure)),
        *tracking.tables(found.tracking),
        *map(html.Note, found.notes),
    ]


def page(found: CalibrationData, hybrid: str = '', next_command: str = '') -> html.Page:
    """Return the report of a calibration.

    Args:
        found: the calibration.
        hybrid: what it means for a hybrid test.
        next_command: what to type next; empty for a command over the same files.
    """
    first = first_page(found, hybrid).ending_with(next_command)
    picture = html.Picture.of(
        posterior(found), 'Distribution of each parameter, and of each pair.'
    )
    known: list[html.Block] = [moments(found), picture, *map(html.Note, found.notes)]
    sections = first_sections(first, known, found.tracking)
    if found.records:
        pictures = []
        left = {e.source: e.rms_m for e in found.error.records}
        some = worst(found.records, lambda record: left.get(record.source, 0.0))
        for record in some:
            figure, inside = bands_figure(found, record)
            name = _called(found, record) or 'a record'
            caption = (
                f'{name}: 95 % bands; the total one holds {100 * inside:.1f} % of the samples.'
            )
            pictures.append(html.Picture.of(figure, caption))
        drawn = [html.Text(said)] if (said := chosen(len(found.records), 'records')) else []
        sections.append(html.Section('Bands over the records', [*drawn, *pictures]))
    made = f'{found.evaluations} evaluations, seed {found.seed}'
    return html.Page('Calibration', first.verdict[0], sections, made)


def first_sections(
    first: FirstPage, known: Sequence[html.Block], tracked: Sequence[tracking.RecordTracking]
) -> list[html.Section]:
    """Return the sections of a report: the answer, what is known, how the command is followed."""
    sections = [
        html.Section('The answer', first.blocks(headline=False)),
        html.Section('Posterior', known),
    ]
    if tracked:
        tables = tracking.tables(tracked)
        sections.append(html.Section('How the actuator follows its command', tables))
    return sections
