"""The study's curves, one CSV file each, units in the header, so that others can plot them."""

from __future__ import annotations

import numpy as np

from studies.chen.convergence import evaluations_at
from studies.chen.library import BASE, NAMES, STIFFNESS, Array, Chains
from studies.chen.misfit import by_frequency
from studies.chen.published import CLOSE_UPS, SHOWN
from studies.chen.responses import CLOSE, GRID, LEVEL, QUANTITIES, UNITS
from studies.chen.shaping import ConvergenceTrace, Shaped
from studies.chen.study import Results

CHAIN_ROWS = 2000
Curve = dict[str, Array]


def curves(results: Results) -> dict[str, Curve]:
    """Return every curve by name: its columns, all of one length, by heading."""
    found: dict[str, Curve] = {}
    for test, stiffness in enumerate(STIFFNESS):
        label = f'k{stiffness / 1e3:g}'
        found |= {
            f'displacement_{label}': _displacement(results, test),
            f'frequency_response_{label}': _frequency_response(results, test),
            f'histograms_{label}': _histograms(results, test),
            f'residual_{label}': _residual(results, test),
        }
    found['spread_against_residual'] = _spread(results)
    for kind, entries in results.shaped.items():
        for s in entries:
            found |= _shaping(f'{kind}_G{s.shaping_factor:g}', s)
    for kind, posterior in results.posteriors.items():
        draws = posterior.thinned(CHAIN_ROWS)
        found[f'draws_{kind}'] = {f'{p.name} [{p.unit}]': draws[:, i] for i, p in enumerate(BASE)}
    return found


def _displacement(results: Results, test: int) -> Curve:
    record = results.records[test]
    columns: Curve = {
        'time [s]': record.time,
        'command [m]': record.command,
        'measured [m]': record.measured,
    }
    for kind, bands in results.time.items():
        lower, upper = bands[test].limits.at(LEVEL)
        columns |= {
            f'{kind} lower [m]': lower,
            f'{kind} median [m]': bands[test].limits.median,
            f'{kind} upper [m]': upper,
        }
    return columns


def _frequency_response(results: Results, test: int) -> Curve:
    columns: Curve = {'frequency [Hz]': GRID}
    for name, response in results.curves[test].items():
        columns[f'{name} amplitude [1]'] = np.asarray(np.abs(response))
        columns[f'{name} phase [rad]'] = np.asarray(np.angle(response))
    for kind, bands in results.frequency.items():
        for name in QUANTITIES:
            limits = bands[test][name].limits
            parts = (limits.lower[0], limits.median, limits.upper[0])
            for part, values in zip(('lower', 'median', 'upper'), parts, strict=True):
                columns[f'{kind} {name} {part} [{UNITS[name]}]'] = values
    return columns


def _histograms(results: Results, test: int) -> Curve:
    bands = results.frequency['matched'][test]
    return {
        f'{name} at {f:g} Hz [{UNITS[name]}]': bands[name].draws[:, at]
        for f, at in zip(CLOSE_UPS, CLOSE, strict=True)
        for name in QUANTITIES
    }


def _residual(results: Results, test: int) -> Curve:
    columns: Curve = {}
    for refit in results.refits.values():
        if test in refit.residual:
            centres, rms = by_frequency(results.records[test], refit.residual[test])
            columns |= {'frequency [Hz]': centres, f'{refit.name} [m]': rms}
    return columns


def _spread(results: Results) -> Curve:
    posteriors = results.table_4.posteriors
    columns: Curve = {'residual rms [m]': np.array([p.best_rms for p in posteriors])}
    for moment in ('mean', 'cov', 'skewness'):
        values = np.array([getattr(p.moments, moment) for p in posteriors])
        columns |= {f'{moment} {n}': values[:, i] for i, n in enumerate(NAMES)}
    return columns


def _shaping(label: str, entry: Shaped) -> dict[str, Curve]:
    found = {
        f'rhat_{label}_published': _rhat(entry.published_trace),
        f'rhat_{label}_ours': _rhat(entry.ours_trace),
    }
    if entry.shaping_factor in SHOWN.values():
        found[f'chains_{label}'] = _chains(entry.published.chains)
    return found


def _rhat(trace: ConvergenceTrace) -> Curve:
    columns = {n: trace.rhat[:, i] for i, n in enumerate(NAMES)}
    return {'evaluations': trace.evaluations} | columns


def _chains(chains: Chains) -> Curve:
    at = np.linspace(0, len(chains.draws) - 1, min(CHAIN_ROWS, len(chains.draws))).astype(int)
    columns: Curve = {'evaluations': np.array([float(evaluations_at(chains, g)) for g in at])}
    for chain in range(chains.draws.shape[1]):
        for i, p in enumerate(BASE):
            columns[f'chain {chain + 1} {p.name} [{p.unit}]'] = chains.draws[at, chain, i]
    return columns
