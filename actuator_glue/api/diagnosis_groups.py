"""A diagnosis as groups of arviz: what was observed, and what its draws say of it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from actuator_glue.api.drawn import Drawn, evenly
from actuator_glue.api.inference_groups import BLOCK, SAMPLES, GroupColumn, at_step, dataset
from actuator_glue.diagnosis.samples.preparation import prepare
from actuator_glue.diagnosis.telling.result import DiagnosisData
from actuator_glue.diagnosis.verdict.traces import Trace
from actuator_glue.hybrid.actuator import table_of
from actuator_glue.inference.least_squares.data import Data, chunks
from actuator_glue.inference.predictive import ResidualModel, predictive_draws
from actuator_glue.records import Array, Record

if TYPE_CHECKING:
    import xarray

_SAME = 1e-3  # of the noise: two simulations of one test are the same one


def observed(parts: Sequence[Trace]) -> dict[str, xarray.Dataset]:
    """Return the groups of what was observed, of the parts of a diagnosis' records."""
    seen: dict[str, GroupColumn] = {}
    constant: dict[str, GroupColumn] = {}
    for number, of in enumerate(parts, 1):
        some = _some(of)
        when = of.time[some]
        seen[f'measured_{number}'] = GroupColumn(number, when, of.measured[some])
        for name in ('command', 'before', 'after'):
            constant[f'{name}_{number}'] = GroupColumn(number, when, getattr(of, name)[some])
    told = _told(parts)
    return {
        'observed_data': dataset(seen, (), told),
        'constant_data': dataset(constant, (), told),
    }


def predicted(
    found: DiagnosisData, of: Drawn, records: Sequence[Record], held: Sequence[Record]
) -> dict[str, xarray.Dataset]:
    """Return what some 200 draws under the structure that is told say of each part.

    Args:
        found: the diagnosis.
        of: its draws.
        records: those it was asked about, as they were given.
        held: those it was given to hold out.

    Returns:
        `posterior_predictive` and `log_likelihood`; nothing where the simulation that was told
        cannot be made again from the records, as where something appeared in the middle of them.
    """
    sides = _sides(found, records, held)
    if not sides or of.residual is None:
        return {}
    rows = evenly(np.arange(len(of.draws)))
    table = table_of(of.draws[rows], of.names, of.structure)
    shape = (1, len(rows))
    rng = np.random.default_rng(0)
    simulated: dict[str, GroupColumn] = {}
    terms: dict[str, GroupColumn] = {}
    number = 0
    for data, parts in sides:
        kept = [np.empty((len(rows), len(p.time[_some(p)]))) for p in parts]
        told = [np.empty((len(rows), len(_seconds(p)))) for p in parts]
        for some in chunks(len(rows), data.target.size):
            moved = data.simulate(of.structure, table[some])
            for i, (part, at) in enumerate(zip(parts, data.parts, strict=True)):
                kept[i][some] = moved[:, at][:, _some(part)]
                told[i][some] = _terms(part, part.measured - moved[:, at], of.residual)
        for part, x, density in zip(parts, kept, told, strict=True):
            number += 1
            measured = predictive_draws(rng, x, at_step(of.residual, _step(part)))
            name, when = f'measured_{number}', part.time[_some(part)]
            begin = part.time[_seconds(part)]
            simulated[name] = GroupColumn(number, when, measured.reshape(*shape, -1))
            terms[name] = GroupColumn(number, begin, density.reshape(*shape, -1), 'block')
    about = _told([part for _, parts in sides for part in parts])
    model = {n: (('chain', 'draw'), of.draws[rows, i][None]) for i, n in enumerate(of.names)}
    as_density = {'block_s': BLOCK, 'of': 'displacement', 'residual': 'AR(1)'}
    return {
        'posterior_predictive': dataset(simulated, rows.tolist(), about).assign_coords(model),
        'log_likelihood': dataset(terms, rows.tolist(), about | as_density).assign_coords(model),
    }


def _told(parts: Sequence[Trace]) -> dict[str, Any]:
    return {
        'source': [p.source for p in parts],
        'held_out': [int(p.held_out) for p in parts],
        'stiffness_n_per_m': [p.stiffness for p in parts],
    }


def _step(part: Trace) -> int:
    return max(1, -(-len(part.time) // SAMPLES))


def _some(part: Trace) -> slice:
    return slice(None, None, _step(part))


def _seconds(part: Trace) -> np.ndarray:
    """Return the start of each second that a part has."""
    label = np.floor((part.time - part.time[0]) / BLOCK + 1e-9)
    return np.flatnonzero(np.diff(label, prepend=-1.0))


def _terms(part: Trace, error: Array, residual: ResidualModel) -> Array:
    """Return the log density of errors (m, n) [m], a term for each second (m, seconds)."""
    off = error - residual.mean
    out = np.empty_like(off)
    for at in part.stretches():
        e = off[:, at]
        late = residual.sd * np.sqrt(1.0 - residual.phi**2)
        out[:, at.start] = _normal(e[:, 0], residual.sd)
        out[:, at.start + 1 : at.stop] = _normal(e[:, 1:] - residual.phi * e[:, :-1], late)
    return np.asarray(np.add.reduceat(out, _seconds(part), axis=1))


def _normal(x: Array, sd: float) -> Array:
    return np.asarray(-0.5 * (np.log(2.0 * np.pi * sd**2) + (x / sd) ** 2))


def _sides(
    found: DiagnosisData, records: Sequence[Record], held: Sequence[Record]
) -> list[tuple[Data, list[Trace]]]:
    """Return the data behind the traces, fitted and held out; none where they cannot be had."""
    if not records:
        return []
    ready = prepare(records, held)
    out = []
    for data, parts in zip((ready.fit, ready.held), _by_side(found.traces), strict=True):
        if len(parts) != len(data.records):
            return []
        setup = found.setup
        if setup is not None and setup.taken:
            hold = setup.hold[0] if 'hold' in setup.changed else None
            data = data.with_setup(stiffness=[p.stiffness for p in parts], hold=hold)
        masks = []
        for part, record in zip(parts, data.records, strict=True):
            index = np.rint(part.time / record.period).astype(np.intp)
            if index[-1] >= len(record):
                return []
            mask = np.zeros(len(record), dtype=np.bool_)
            mask[index] = True
            masks.append(mask)
        data = replace(data, masks=tuple(masks))
        told = np.concatenate([p.after for p in parts])
        again = data.simulate(found.model, found.best)[0]
        if not np.abs(again - told).max() <= _SAME * found.error.noise_floor:
            return []
        out.append((data, parts))
    return out


def _by_side(traces: Sequence[Trace]) -> Iterator[list[Trace]]:
    for side in (False, True):
        yield [t for t in traces if t.held_out is side]
