"""The study's curves as CSV, one file each, units in the header, so that others can plot them."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np

from actuator_glue.inference.dream import Chains
from actuator_glue.inference.scores import Scores
from actuator_glue.model.parameters import BASE, NAMES
from actuator_glue.model.problem_r import STIFFNESS
from actuator_glue.records import Array
from actuator_glue.reproduction.misfit import by_frequency
from actuator_glue.reproduction.published import SHOWN
from actuator_glue.reproduction.responses import GRID, LEVEL
from actuator_glue.reproduction.shaping import Shaped
from actuator_glue.reproduction.study import Results

CHAIN_ROWS = 2000


def write(results: Results, folder: Path) -> list[Path]:
    """Write one CSV file per curve, units in the header, and return their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    spread = results.table_4
    written = []

    def put(name: str, columns: Mapping[str, Array]) -> None:
        written.append(_write_csv(folder / f'{name}.csv', columns))

    for test, record in enumerate(results.records):
        label = f'k{STIFFNESS[test] / 1e3:g}'
        columns: dict[str, Array] = {
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
        put(f'displacement_{label}', columns)
        for kind, bands in results.time.items():
            put(f'scores_{kind}_{label}', _scores(bands[test].scores))
        curve = results.curves[test]
        columns = {'frequency [Hz]': GRID}
        for name, response in (
            ('experiment', curve.experiment),
            ('identified', curve.identified),
            ('table 2', curve.table_2),
        ):
            columns[f'{name} amplitude [1]'] = np.asarray(np.abs(response))
            columns[f'{name} phase [rad]'] = np.asarray(np.angle(response))
        for kind, wide in results.frequency.items():
            for quantity, draws in (('dB', wide[test].amplitude), ('rad', wide[test].phase)):
                for q in (0.025, 0.5, 0.975):
                    columns[f'{kind} quantile {q:g} [{quantity}]'] = np.asarray(
                        np.quantile(draws, q, axis=0)
                    )
        put(f'frequency_response_{label}', columns)
        close = results.frequency['matched'][test]
        columns = {}
        for i, frequency in enumerate((1, 5, 10)):
            columns[f'amplitude at {frequency} Hz [dB]'] = close.close_amplitude[:, i]
            columns[f'phase at {frequency} Hz [rad]'] = close.close_phase[:, i]
        put(f'histograms_{label}', columns)
        both = [r for r in results.refits if len(r.tests) == 2]
        columns = {'frequency [Hz]': by_frequency(record, both[0].residual[test])[0]}
        for r in both:
            columns[f'{r.name} [m]'] = by_frequency(record, r.residual[test])[1]
        put(f'residual_{label}', columns)
    put(
        'spread_against_residual',
        {'residual rms [m]': spread.rms}
        | {f'cov {n}': spread.cov[:, i] for i, n in enumerate(NAMES)}
        | {f'skewness {n}': spread.skewness[:, i] for i, n in enumerate(NAMES)},
    )
    for kind, entries in results.shaped.items():
        put(f'shaping_factors_{kind}', _shaping(entries))
        for s in entries:
            label = f'{kind}_G{s.shaping_factor:g}'
            for who, trace in (('published', s.published_trace), ('ours', s.ours_trace)):
                put(
                    f'rhat_{label}_{who}',
                    {'evaluations': trace.evaluations}
                    | {n: trace.rhat[:, i] for i, n in enumerate(NAMES)},
                )
            if s.shaping_factor in SHOWN.values():
                put(f'chains_{label}', _chains(s.published.chains))
    for kind, posterior in results.posteriors.items():
        draws = posterior.thinned(2000)
        put(
            f'draws_{kind}',
            {f'{p.name} [{p.unit}]': draws[:, i] for i, p in enumerate(BASE)},
        )
    return written


def _scores(scores: Sequence[Scores]) -> dict[str, Array]:
    # The first entry counts everything; its upper edge is infinite.
    return {
        'from [Hz]': np.array([s.low_hz for s in scores]),
        'to [Hz]': np.array([s.high_hz for s in scores]),
        'coverage': np.array([s.coverage for s in scores]),
        'mean width [m]': np.array([s.mean_width for s in scores]),
        'CRPS [m]': np.array([s.crps for s in scores]),
        'interval score [m]': np.array([s.interval_score for s in scores]),
    }


def _shaping(entries: Sequence[Shaped]) -> dict[str, Array]:
    columns = {
        'G': [s.shaping_factor for s in entries],
        'held-out coverage': [s.held_out for s in entries],
        'mean width [m]': [s.width for s in entries],
    }
    for i, name in enumerate(NAMES):
        columns[f'cov {name}'] = [s.ours.moments.cov[i] for s in entries]
    return {name: np.array(values) for name, values in columns.items()}


def _chains(chains: Chains) -> dict[str, Array]:
    at = np.linspace(0, len(chains.draws) - 1, min(CHAIN_ROWS, len(chains.draws))).astype(int)
    columns = {'evaluations': np.array([chains.evaluations_at(g) for g in at], dtype=np.float64)}
    for chain in range(chains.draws.shape[1]):
        for i, p in enumerate(BASE):
            columns[f'chain {chain + 1} {p.name} [{p.unit}]'] = chains.draws[at, chain, i]
    return columns


def _write_csv(path: Path, columns: Mapping[str, Array]) -> Path:
    with path.open('w', newline='', encoding='utf-8') as file:
        writer = csv.writer(file)
        writer.writerow(columns)
        rows: Iterable[tuple[float, ...]] = zip(*columns.values(), strict=True)
        writer.writerows([f'{value:.9g}' for value in row] for row in rows)
    return path
