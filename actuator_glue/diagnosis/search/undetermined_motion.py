"""Motion that no parameters determine: where a piston slips, sticks and comes to rest by chance.

Friction that falls with velocity makes a piston jump. As it comes to a standstill, each jump
depends on the one before: with parameters changed by a millionth it jumps or not, and rests some
micrometres elsewhere from then on. With 300 N in sweeps to 10 Hz the simulation changed by up to
250 um there. A fit stops anywhere in such a landscape, and its residual there is no missing
effect: these samples do not count.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy

from actuator_glue.diagnosis.refits import global_search
from actuator_glue.diagnosis.refits.refits import Refits
from actuator_glue.diagnosis.samples.preparation import Prepared
from actuator_glue.diagnosis.score.scorer import Scorer, splits_of, structure_and_noise
from actuator_glue.diagnosis.thresholds import least_material
from actuator_glue.diagnosis.trial import Trial
from actuator_glue.hygiene.checks import where
from actuator_glue.inference.least_squares.data import Data, Mask
from actuator_glue.inference.least_squares.fit import Fit, fit, rms
from actuator_glue.inference.least_squares.free_run import Model, simulated
from actuator_glue.model.effects import CATALOGUE
from actuator_glue.records import Array

_DRAWS = 32  # as many as the kernel works on at a time
_APART = 1e-3  # relative: less than records tell of parameters
_AROUND = 1.0  # s
_SMALL = 0.2  # of what is material: with all of it single jumps beside a calm second still count
_SEED = 0
# Of the squared error: friction that holds the piston leaves at most the first share; friction
# that does not fall with velocity at most the second, where falling friction may hold the piston.
_HOLDS, _SIMPLE = 0.25, 0.5
_ROUNDS = 3
_ITERATIONS, _TOLERANCE = 25, 1e-5
# s of each record that must still count, fitted and held out; else all stay as they are.
_FITTED, _HELD = 5.0, 1.0


def undetermined(data: Data, model: Model, theta: Array, size: float) -> tuple[Mask, ...]:
    """Return the samples (n,) of each record that parameters near these do not determine.

    There the simulations of parameters drawn around theta differ by more than `size` from what is
    linear in the parameters.

    Args:
        data: records.
        model: what simulates them, p parameters.
        theta: (p,).
        size: rms over a second [m].
    """
    moves = np.random.default_rng(_SEED).standard_normal((_DRAWS, len(theta)))
    linear = np.linalg.qr(np.column_stack([np.ones(_DRAWS), moves]))[0]
    cloud = theta * np.exp(_APART * moves)
    free, out = _DRAWS - linear.shape[1], []
    for record, initial, origin in zip(data.records, data.initials, data.origins, strict=True):
        y = simulated(model, cloud, record, initial, origin)
        y -= linear @ (linear.T @ y)
        square = np.einsum('mn,mn->n', y, y) / free
        width = max(1, round(_AROUND / record.period))
        out.append(scipy.ndimage.uniform_filter1d(square, width, mode='nearest') > size**2)
    return tuple(out)


def without(prepared: Prepared, refits: Refits, fixed: bool) -> tuple[Prepared, Refits]:
    """Exclude samples that friction leaves to chance, where it explains most but not all.

    Args:
        prepared: records.
        refits: what was refitted to the fitting part, or to what hum leaves of it.
        fixed: whether all counted samples stay counted.

    Returns:
        Both unchanged where nothing is left to chance, or nearly everything; else the search
        knows the friction that was found.
    """
    for rich in (CATALOGUE[n] for n in refits.names):
        if rich.group != 'friction' or rich.holds is None:
            continue
        refits.scorer = Scorer.of(refits.data, splits_of(refits.data, refits.base().error))
        base = refits.trial(())
        simple = refits.polish(refits.add(base, rich.holds[0], refits.each))
        left, noise = structure_and_noise(refits.data, simple.fit.error)
        size = least_material(noise, refits.scale().stroke)
        if simple.mean_square > _SIMPLE * base.mean_square or left < size:
            continue
        found = _found(refits, simple, rich.name, size, fixed)
        if found is None:
            continue
        lost, best = found
        known = {frozenset([rich.name]): best}
        fewer, effort = _counted(refits.data, lost), refits.effort
        again = Refits(fewer, refits.names, refits.each, effort=effort, _tried=known)
        if fixed:
            return prepared, again
        model = refits.structure(rich.name)
        away = undetermined(prepared.held, model, best.theta, _SMALL * size)
        held = _counted(prepared.held, away)
        if _least(held) < _HELD:
            continue
        fit, notes = _counted(prepared.fit, lost), _notes(prepared.fit, lost, _SMALL * size)
        return replace(prepared, fit=fit, held=held, notes=(*notes, *prepared.notes)), again
    return prepared, refits


def _found(
    refits: Refits, simple: Trial, name: str, size: float, fixed: bool
) -> tuple[tuple[Mask, ...], Fit] | None:
    """Samples left to chance, and the fit to all others; None where there are none."""
    data, model = refits.data, refits.structure(name)
    shapes = np.unique(np.array(CATALOGUE[name].starts(refits.scale()))[:, 1:], axis=0)
    starts = np.column_stack([np.tile(simple.fit.theta, (len(shapes), 1)), shapes])
    found = fit(data, model, starts, tolerance=_TOLERANCE)
    lost = tuple(np.zeros_like(m) for m in data.masks)
    for _ in range(1 if fixed else _ROUNDS):
        if not fixed:
            now = undetermined(data, model, found.theta, _SMALL * size)
            if not any((new & ~old).any() for new, old in zip(now, lost, strict=True)):
                break
            lost = now
        some = _counted(data, lost)
        if _least(some) < _FITTED:
            return None
        again = fit(some, model, found.theta, iterations=1)
        found = global_search.refit(some, model, again, _ITERATIONS, _TOLERANCE, refits.each)
    determined = np.concatenate([~b[m] for m, b in zip(data.masks, lost, strict=True)])
    base, roughly = (rms(f.error[determined]) for f in (refits.base(), simple.fit))
    better = roughly**2 - found.rms**2 > size**2 and found.rms**2 <= _HOLDS * base**2
    return (lost, found) if better and (fixed or not determined.all()) else None


def _counted(data: Data, lost: tuple[Mask, ...]) -> Data:
    pairs = zip(data.masks, lost, strict=True)
    return replace(data, masks=tuple(mask & ~bad for mask, bad in pairs))


def _least(data: Data) -> float:
    """Counted time of the record that has least of it [s]."""
    return min(float(m.sum()) * period for m, period in zip(data.masks, data.periods, strict=True))


def _notes(data: Data, lost: tuple[Mask, ...], size: float) -> list[str]:
    """Say what does not count, for people."""
    out = []
    for i, (record, bad) in enumerate(zip(data.records, lost, strict=True)):
        if bad.any():
            out.append(
                f'{where(record, i + 1)}: {bad.sum() * record.period:.1f} s from '
                f'{record.time[bad.argmax()]:.1f} s on do not count: the piston slips, sticks and '
                'comes to rest there by chance, parameters changed by a thousandth leave it more '
                f'than {1e6 * size:.1f} um elsewhere'
            )
    return out
