"""The study's curves as CSV, one file each, units in the header, so that others can plot them."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np

from actuator_glue.model.parameters import BASE, NAMES
from actuator_glue.model.problem_r import STIFFNESS
from actuator_glue.records import Array
from actuator_glue.reproduction.misfit import by_frequency
from actuator_glue.reproduction.responses import GRID, LEVEL
from actuator_glue.reproduction.study import Results


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
        for s in entries:
            for who, trace in (('published', s.published_trace), ('ours', s.ours_trace)):
                put(
                    f'rhat_{kind}_G{s.shaping_factor:g}_{who}',
                    {'evaluations': trace.evaluations}
                    | {n: trace.rhat[:, i] for i, n in enumerate(NAMES)},
                )
    for kind, posterior in results.posteriors.items():
        draws = posterior.thinned(2000)
        put(
            f'draws_{kind}',
            {f'{p.name} [{p.unit}]': draws[:, i] for i, p in enumerate(BASE)},
        )
    return written


def _write_csv(path: Path, columns: Mapping[str, Array]) -> Path:
    with path.open('w', newline='', encoding='utf-8') as file:
        writer = csv.writer(file)
        writer.writerow(columns)
        rows: Iterable[tuple[float, ...]] = zip(*columns.values(), strict=True)
        writer.writerows([f'{value:.9g}' for value in row] for row in rows)
    return path
