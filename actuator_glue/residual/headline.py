"""The one line of a diagnosis, and whether the held-out part bears it out."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from actuator_glue.residual.diagnosis import Diagnosis, Finding, HeldOutError

# Held-out errors beyond this many times the noise say that the fitting records lack something.
_BEYOND = 2.0
# Share of the removable error that is printed as 0.0 %.
_NOTHING = 5e-4


def misses(error: HeldOutError, material: float) -> bool:
    """Whether the held-out part shows more than noise, by what counts as material [m]."""
    floor = error.noise_floor
    return error.after > _BEYOND * floor and error.after**2 - floor**2 > material**2


def of_motion(found: Diagnosis) -> list[Finding]:
    """Return findings that change the simulated motion; the others only add to the noise."""
    return [e for e in found.effects if e.noise is None]


def removes_nothing(found: Diagnosis) -> bool:
    """Whether effects were found for the motion that leave the held-out error as it was."""
    return bool(of_motion(found)) and found.error.removable_removed < _NOTHING


def borne_out(found: Diagnosis) -> bool:
    """Whether the held-out part shows what the verdict says."""
    return not misses(found.error, found.alarm.threshold) and not removes_nothing(found)


def _named(effect: Finding) -> str:
    where = f' in {", ".join(effect.records)} only' if effect.records else ''
    others = f' (or {", ".join(effect.alternatives)})' if effect.alternatives else ''
    return effect.name + where + others


def _noise(found: Diagnosis) -> str:
    """Say how large the noise is, by itself or beside the error, and what is known to make it."""
    floor = found.error.noise_floor
    parts = [f'{1e6 * (e.noise or 0.0):.1f} um by {e.name}' for e in found.effects if e.noise]
    text = f'noise {1e6 * floor:.1f} um'
    if misses(found.error, found.alarm.threshold):
        times = found.error.after / floor if floor > 0.0 else math.inf
        text = f'{times:.1f} times the noise of {1e6 * floor:.1f} um'
    return f'{text} ({", ".join(parts)})' if parts else text


def headline(found: Diagnosis) -> str:
    """Return the verdict in one line, never more than the held-out part bears out."""
    moved = of_motion(found)
    before, after = 1e6 * found.error.before, 1e6 * found.error.after
    change = f'held-out error {before:.1f} -> {after:.1f} um, {_noise(found)}'
    still = f'held-out error {after:.1f} um, {_noise(found)}'
    missed = misses(found.error, found.alarm.threshold)
    if found.verdict == 'unexplained':
        if not moved:
            return f'the model is not enough and no catalogued effect explains why: {still}'
        names = ', '.join(e.name for e in moved)
        return (
            f'the model is not enough and the catalogue explains it only in part ({names}): '
            f'{change}'
        )
    if removes_nothing(found):
        return f'what the fitting records show is not in the held-out part: {change}'
    if moved:
        names = ', '.join(map(_named, moved))
        return f'missing: {names}{", and more" if missed else ""}; {change}'
    if missed:
        return f'the model explains the fitting records but not the held-out part: {still}'
    return f'the model is enough: {still}'
