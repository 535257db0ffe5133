"""From a posterior to the stability of a hybrid test."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from typing import TypedDict, Unpack

import numpy as np

from actuator_glue.api import options
from actuator_glue.api.bar import shown
from actuator_glue.api.calibration_given import calibration_given
from actuator_glue.api.calibration_result import Calibration
from actuator_glue.api.drawn import evenly
from actuator_glue.api.effect_cost import effect_costs, margins
from actuator_glue.api.given import seed_given
from actuator_glue.api.options import takes
from actuator_glue.api.partition_given import partition_given
from actuator_glue.api.spread import spread
from actuator_glue.api.stability import StabilityResult
from actuator_glue.api.stability_data import AtFrequency, DelayMargin
from actuator_glue.api.tracking import FREQUENCIES
from actuator_glue.api.virtual_test import VirtualResult, check_criteria, run, summarise
from actuator_glue.errors import InputError
from actuator_glue.given import number, of_kind, whole
from actuator_glue.hybrid import stability
from actuator_glue.hybrid.actuator import nonlinear
from actuator_glue.hybrid.compensator import Compensator
from actuator_glue.hybrid.design import Loop, compensator_of
from actuator_glue.hybrid.ground_motion import GroundMotion
from actuator_glue.hybrid.margin import classical_margins, nominal, pure_delay_margin
from actuator_glue.hybrid.partition import Partition
from actuator_glue.hybrid.stability import Flags
from actuator_glue.hybrid.virtual import DIVERGED, VirtualTest
from actuator_glue.io.ground_motion import read_ground_motion
from actuator_glue.records import Array

DRAWS = 1000
# Logarithm of a growth with which linear loops diverge within a record: from a fifth of the
# reference's peak to five times it.
_ENOUGH = 2.0 * math.log(DIVERGED)


@dataclass(frozen=True, slots=True)
class Showing:
    """How a hybrid test shows how far it is.

    Attributes:
        progress: called with the share of the virtual test that is done, in (0, 1]; True for a
            bar, False for none; None for a bar in a notebook only. A callback that fails is not
            called again.
    """

    progress: Callable[[float], object] | bool | None = None


class ShowingChanges(TypedDict, total=False):
    """The same by name, for type checkers."""

    progress: Callable[[float], object] | bool | None


@takes(Showing)
def rths(
    partition: Partition | Path | str,
    calibration: Calibration | Path | str,
    *,
    draws: int = DRAWS,
    frequencies: Sequence[float] | float = FREQUENCIES,
    compensator: str = 'none',
    ground_motion: GroundMotion | Path | str | None = None,
    criteria: Mapping[str, float] | None = None,
    seed: int | None = 1,
    **changes: Unpack[ShowingChanges],
) -> StabilityResult:
    """Return how likely a hybrid test is unstable with a calibrated actuator.

    Each draw's actuator, Eq. (2a) with the specimen's stiffness and the linear effects of the
    model, stands in the sampled loop of the partition. With a ground motion each draw runs the
    record, all its effects included.

    Args:
        partition: the hybrid test; a YAML file, or the name of one that comes with the package.
        calibration: posterior of the actuator, or the file it was saved to.
        draws: how many of its draws are used, evenly spread over it.
        frequencies: where the actuator's delay and amplitude are told [Hz].
        compensator: 'none', 'inverse' of the posterior mean, 'ats-fixed' (the same within the
            usual limits of the adaptive time series), 'ats' (adaptive), 'robust' (smallest 95th
            percentile of J2).
        ground_motion: a file, 'artificial' or 'artificial:SEED'.
        criteria: peaks that must not be exceeded: 'drift' and 'displacement' of any floor [m],
            'force' of the specimen [N].
        seed: of the specimen's draws, where the partition gives it standard deviations, and of
            the sensors' noise; None for a fresh one, which the result says.
        changes: `progress` by name, see `Showing`.

    Raises:
        InputError: a partition, posterior or option that cannot be used.

    Example:
        >>> found = rths('benchmark_case_1', posterior)  # doctest: +SKIP
        >>> found.p_unstable.upper  # doctest: +SKIP
    """
    asked = options.chosen(Showing, None, changes, 'rths')
    seed, draws = seed_given(seed), whole(draws, 'draws')
    partition = partition_given(partition)
    calibration = calibration_given(calibration)
    frequencies = [number(f, 'frequencies') for f in np.ravel(np.asarray(frequencies, object))]
    motion_kinds = (GroundMotion, str, PathLike, type(None))
    of_kind(ground_motion, 'ground_motion', motion_kinds, "a file, or 'artificial'")
    of_kind(criteria, 'criteria', (Mapping, type(None)), "limits by name, as {'drift': 0.005}")
    criteria = {n: number(v, f'criterion {n}') for n, v in (criteria or {}).items()}
    if draws < 2:
        raise InputError(f'{draws} draws are no distribution; use at least 2')
    started = time.perf_counter()
    if ground_motion is not None and not isinstance(ground_motion, GroundMotion):
        ground_motion = read_ground_motion(ground_motion)
    _check(partition, frequencies, ground_motion, criteria)
    curved = nonlinear(calibration.effects)
    if curved and ground_motion is None:
        raise InputError(
            f'the posterior has {", ".join(curved)}, which no linear loop has; give a ground '
            'motion for a virtual test, or calibrate with linear effects only'
        )
    posterior = calibration.posterior
    used = evenly(posterior, draws)
    specimen = partition.specimen.drawn(np.random.default_rng(seed), len(used))
    loop = Loop.of(partition, used, calibration.names, calibration.effects, specimen)
    ground = None if ground_motion is None else ground_motion.at(partition.period)
    chosen = compensator_of(compensator, loop, ground)
    effective = _effective(calibration)
    virtual: VirtualResult | None = None
    if ground is not None and ground_motion is not None:
        test = VirtualTest(
            partition, loop.draws, loop.names, loop.effects, specimen, chosen, ground, seed
        )
        motion = ground_motion.name, ground_motion.duration
        with shown('virtual test', 1.0, asked.progress) as done:
            responses = run(test, done)
        virtual = summarise(responses, test.time, motion, criteria, effective)
    margin, growth = margins(loop, chosen)
    moved = 0.0
    if virtual is not None:
        moved = float(np.sqrt(2.0 * np.mean(virtual.reference[:, partition.interface] ** 2)))
    tracking = stability.tracking(loop.actuators, frequencies)
    inputs = {n: loop.draws[:, i] for i, n in enumerate(loop.names)}
    inputs |= {f'specimen {n}': column for n, column in specimen.items()}
    sensitive = stability.sensitivity(margin, inputs)
    with_mean = stability.loops(partition, partition.specimen.nominal, loop.mean.system, chosen)
    by_test = virtual is not None and (bool(curved) or chosen.adaptive)
    unstable = stability.share(growth > 0.0, effective)
    notes = _notes(loop, calibration, chosen, by_test)
    endless = np.isinf(margin)
    if endless.any() and not endless.all():
        notes.append(
            f'{int(endless.sum())} of {len(margin)} draws bear any delay: no spread of the delay '
            'margin is told'
        )
    if virtual is not None and by_test:
        unstable = virtual.diverged
        # Coefficients that adapt leave the roots of the first ones behind.
        slow = _slow(responses.diverged, growth, virtual.duration_s) & (not chosen.adaptive)
        if slow.any():
            either = stability.share(responses.diverged | slow, effective)
            unstable = replace(unstable, upper=either.upper)
            notes.insert(0, _slow_note(slow, growth, curved, virtual.duration_s))
    return StabilityResult(
        partition=partition.name,
        natural_frequencies_hz=tuple(map(float, partition.natural_frequencies)),
        rate_hz=partition.rate,
        delay_margin=DelayMargin(*pure_delay_margin(partition)),
        margins={
            'perfect_actuator': classical_margins(nominal(partition)),
            'mean_actuator': classical_margins(with_mean),
        },
        p_unstable=unstable,
        unstable_by='virtual test' if by_test else 'characteristic roots',
        margin_s=spread(margin) if np.isfinite(margin).all() else None,
        growth_per_s=spread(growth),
        bandwidth_hz=spread(tracking.bandwidth),
        tracking=tuple(
            AtFrequency(float(f), spread(tracking.delay[:, i]), spread(tracking.amplitude[:, i]))
            for i, f in enumerate(frequencies)
        ),
        sensitivity=sensitive,
        most_sensitive=max(sensitive, key=lambda n: abs(sensitive[n]), default=None),
        effect_cost_s=effect_costs(loop, chosen, margin, moved),
        compensator=str(chosen),
        virtual=virtual,
        draws=len(used),
        seconds=time.perf_counter() - started,
        problems=calibration.problems,
        notes=tuple(notes),
        margins_drawn=margin,
        growth_drawn=growth,
        seed=seed,
    )


def _check(
    partition: Partition,
    frequencies: Sequence[float],
    motion: GroundMotion | None,
    criteria: Mapping[str, float],
) -> None:
    half = 0.5 * partition.rate
    for f in frequencies:
        if not 0.0 < f <= half:
            raise InputError(f'frequency {f:g} Hz is outside (0, {half:g}] Hz')
    if criteria and motion is None:
        raise InputError('a criterion needs a ground motion: without one nothing moves')
    check_criteria(criteria)


def _effective(calibration: Calibration) -> float:
    """Return how many independent draws a posterior is worth: those of its worst parameter."""
    sizes = np.array([p.ess for p in calibration.parameters.values()])
    return float(np.nanmin(sizes)) if np.isfinite(sizes).any() else 1.0


def _slow(diverged: Flags, growth: Array, duration: float) -> Flags:
    """Return which draws are unstable, but grow too slowly to diverge within a record.

    One that had the time for it and did not is held by its nonlinear effects.
    """
    grown = growth * duration
    return ~diverged & (grown > 0.0) & (grown < _ENOUGH)


def _slow_note(slow: Flags, growth: Array, curved: Sequence[str], duration: float) -> str:
    """Return what the roots say against draws that did not diverge."""
    return (
        f'{100.0 * slow.mean():.3g} % of the draws do not diverge in {duration:g} s, but are '
        f'unstable without {", ".join(curved)}: they grow by {np.median(growth[slow]):.3g} 1/s; '
        'the upper limit of P(unstable) counts them'
    )


def _notes(loop: Loop, calibration: Calibration, chosen: Compensator, by_test: bool) -> list[str]:
    """Return what limits the answer."""
    notes = []
    partition = loop.partition
    if not calibration.converged:
        notes.append('the chains of the posterior have not converged (R-hat above 1.01)')
    known = [s.stiffness_n_per_m for s in calibration.sources if s.stiffness_n_per_m is not None]
    k = partition.specimen.stiffness
    if known and not min(known) <= k <= max(known):
        notes.append(
            f'specimen stiffness {k:g} N/m lies outside those of the calibration '
            f'({min(known):g} to {max(known):g} N/m): Eq. (2) extrapolates'
        )
    if partition.specimen.mass > 0.0 and 'payload-inertia' not in loop.effects:
        notes.append(
            'Eq. (2) takes the specimen as a massless spring; its mass and damping act on the '
            'structure, not on the actuator'
        )
    if float(loop.mean.delay[0]) > 0.0:
        notes.append('gain and phase margin of the mean actuator leave its delay effect out')
    curved = nonlinear(loop.effects)
    if curved:
        notes.append(f'margins, roots and delays leave {", ".join(curved)} out')
    if chosen.adaptive:
        first = 'margins and roots' if by_test else 'P(unstable), margins and roots'
        notes.append(f'{first} are those of the first coefficients; they adapt during a test')
    return notes
