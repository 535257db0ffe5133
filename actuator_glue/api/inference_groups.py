"""A calibration as groups of arviz: draws, and what they say of the records."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from actuator_glue.api.calibration_data import CalibrationData
from actuator_glue.api.drawn import SIZE, evenly
from actuator_glue.hybrid.actuator import table_of
from actuator_glue.inference.likelihood import PHI
from actuator_glue.inference.predictive import ResidualModel, predictive_draws
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array

if TYPE_CHECKING:
    import arviz
    import xarray

SAMPLES = 2000  # of a record
BLOCK = 1.0  # s of a term of the log likelihood
_AT_ONCE = 20  # draws that are simulated at once


def groups(found: CalibrationData) -> arviz.InferenceData:
    """Return everything that is known; see `Calibration.inference_data`."""
    import arviz as az

    data = az.from_dict(
        posterior={n: found.draws[:, :, i].T for i, n in enumerate(found.names)},
        sample_stats={'lp': found.log_density.T},
    )
    for name, marginal in found.parameters.items():
        data.posterior[name].attrs |= {
            'unit': marginal.unit,
            'prior': 'uniform',
            'lower': marginal.bounds[0],
            'upper': marginal.bounds[1],
        }
    data.posterior.attrs |= {'likelihood': found.likelihood, 'effects': list(found.effects)}
    if found.records:
        data.add_groups(_of_records(found))
    return data


class GroupColumn:
    """Values of one record at some of its times, last axis; before it the draws, if any."""

    def __init__(self, record: int, time: Array, values: Array, dim: str = 'time') -> None:
        self.dim = f'{dim}_{record}'
        self.time, self.values = time, values


def dataset(
    columns: Mapping[str, GroupColumn], draws: Sequence[int], attributes: Mapping[str, Any]
) -> xarray.Dataset:
    """Return columns as a group; draws are numbers of steps, none for what was observed."""
    import xarray

    before = ('chain', 'draw') if len(draws) else ()
    coordinates: dict[str, Any] = {c.dim: c.time for c in columns.values()}
    if before:
        chains = next(iter(columns.values())).values.shape[0]
        coordinates |= {'chain': np.arange(chains), 'draw': np.asarray(draws)}
    return xarray.Dataset(
        {name: ((*before, c.dim), c.values) for name, c in columns.items()},
        coords=coordinates,
        attrs=dict(attributes),
    )


def _of_records(found: CalibrationData) -> dict[str, xarray.Dataset]:
    steps, chains, _ = found.draws.shape
    each = max(2, -(-SIZE // chains))
    used = evenly(np.arange(steps), each)
    rows = np.ascontiguousarray(found.draws[used].reshape(len(used) * chains, -1))
    shape = (len(used), chains)
    phi = rows[:, found.names.index(PHI.name)] if PHI.name in found.names else None
    likelihood = _Likelihood(found, len(rows))
    predicted: dict[str, GroupColumn] = {}
    observed: dict[str, GroupColumn] = {}
    constant: dict[str, GroupColumn] = {}
    rng = np.random.default_rng(found.seed)
    structure = Structure(found.effects)
    table = table_of(rows, found.names, structure)
    for number, record in enumerate(found.records, 1):
        settle = round(found.settle / record.period)
        some = np.arange(settle, len(record), max(1, -(-(len(record) - settle) // SAMPLES)))
        kept = np.empty((len(rows), len(some)))
        for start in range(0, len(rows), _AT_ONCE):
            part = slice(start, start + _AT_ONCE)
            moved = structure.simulate(table[part], record, initial=found.initial)
            kept[part] = moved[:, some]
            error = record.measured[settle:] - moved[:, settle:]
            likelihood.add(part, number - 1, error, None if phi is None else phi[part])
        if found.residual is not None:
            apart = at_step(found.residual, int(some[1] - some[0]) if len(some) > 1 else 1)
            kept = predictive_draws(rng, kept, apart)
        name, when = f'measured_{number}', record.time[some]
        by_chain = kept.reshape(*shape, -1).swapaxes(0, 1)
        predicted[name] = GroupColumn(number, when, by_chain)
        observed[name] = GroupColumn(number, when, record.measured[some])
        constant[f'command_{number}'] = GroupColumn(number, when, record.command[some])
    told: dict[str, Any] = {
        'source': [r.source for r in found.records],
        'stiffness_n_per_m': [float(r.known_stiffness()) for r in found.records],
    }
    blocks = {
        f'measured_{number}': GroupColumn(
            number, when, terms.reshape(*shape, -1).swapaxes(0, 1), 'block'
        )
        for number, (when, terms) in enumerate(likelihood.terms(phi), 1)
    }
    return {
        'posterior_predictive': dataset(predicted, used.tolist(), told),
        'log_likelihood': dataset(
            blocks, used.tolist(), {**told, 'block_s': BLOCK, 'of': 'displacement'}
        ),
        'observed_data': dataset(observed, (), told),
        'constant_data': dataset(constant, (), told),
    }


def at_step(residual: ResidualModel, step: int) -> ResidualModel:
    """Return the residual of every so many-th sample, its level as well known as before."""
    if step == 1:
        return residual
    apart = replace(residual, phi=residual.phi**step, samples=residual.samples)
    worth = (residual.freedom + 1.0) / (apart.freedom + 1.0)
    return replace(apart, samples=max(2, round(apart.samples * worth)))


class _Likelihood:
    """The log likelihood of draws in terms of a second each, which add up to the whole.

    Where a likelihood has its variance integrated out or is Eq. (4), each draw's own variance is
    taken: -G ln Var = sum of -(G / n) (ln Var + e^2 / Var), but for a constant.
    """

    def __init__(self, found: CalibrationData, draws: int) -> None:
        self._found = found
        self._starts = []
        for record in found.records:
            settle = round(found.settle / record.period)
            size = max(1, round(BLOCK / record.period))
            self._starts.append(np.arange(0, len(record) - settle, size))
        shapes = [(draws, len(starts)) for starts in self._starts]
        self._sum = [np.zeros(shape) for shape in shapes]
        self._square = [np.zeros(shape) for shape in shapes]

    def add(self, draws: slice, record: int, error: Array, phi: Array | None) -> None:
        """Take the errors (k, n) of some draws in one record; `phi` where they are correlated."""
        if phi is not None:
            late = error[:, 1:] - phi[:, None] * error[:, :-1]
            first = error[:, :1] * np.sqrt(1.0 - phi[:, None] ** 2)
            error = np.hstack([first, late])
        starts = self._starts[record]
        self._sum[record][draws] = np.add.reduceat(error, starts, axis=1)
        self._square[record][draws] = np.add.reduceat(error**2, starts, axis=1)

    def terms(self, phi: Array | None) -> list[tuple[Array, Array]]:
        """Return start [s] and terms (draws, blocks) of each record's seconds."""
        found = self._found
        sizes = [
            np.diff(np.append(starts, len(r) - round(found.settle / r.period)))
            for starts, r in zip(self._starts, found.records, strict=True)
        ]
        count = float(sum(size.sum() for size in sizes))
        glue = found.likelihood == 'glue'
        mean = sum(s.sum(axis=1) for s in self._sum) / count if glue else np.zeros(1)
        centre = np.reshape(mean, (-1, 1))
        squares = [
            q - 2.0 * centre * s + size * centre**2
            for q, s, size in zip(self._square, self._sum, sizes, strict=True)
        ]
        variance = np.reshape(sum(q.sum(axis=1) for q in squares) / count, (-1, 1))
        weight = 2.0 * (found.shaping_factor or 0.0) / count if glue else 1.0
        out: list[tuple[Array, Array]] = []
        for q, size, starts, r in zip(squares, sizes, self._starts, found.records, strict=True):
            terms = -0.5 * weight * (size * np.log(2.0 * np.pi * variance) + q / variance)
            if phi is not None:
                terms[:, 0] += 0.5 * np.log1p(-(phi**2))
            begin = np.asarray(found.settle + starts * r.period, dtype=np.float64)
            out.append((begin, np.asarray(terms)))
        return out
