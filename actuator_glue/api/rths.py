"""From a posterior to the stability of a hybrid test."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from actuator_glue.api.calibration_result import Calibration
from actuator_glue.api.stability import AtFrequency, DelayMargin, Spread, StabilityResult
from actuator_glue.errors import InputError
from actuator_glue.hybrid import stability
from actuator_glue.hybrid.linear_system import System
from actuator_glue.hybrid.loop import actuator, inverse_compensator
from actuator_glue.hybrid.margin import classical_margins, nominal, pure_delay_margin
from actuator_glue.hybrid.partition import Partition
from actuator_glue.io.partition import read_partition
from actuator_glue.records import Array

COMPENSATORS = ('none', 'inverse')
FREQUENCIES = (1.0, 5.0, 10.0)  # Hz
DRAWS = 1000


def rths(
    partition: Partition | Path | str,
    calibration: Calibration,
    *,
    draws: int = DRAWS,
    frequencies: Sequence[float] = FREQUENCIES,
    compensator: str = 'none',
    band_hz: float | None = None,
    seed: int = 1,
) -> StabilityResult:
    """Return how likely a hybrid test is unstable with a calibrated actuator.

    Each draw's closed-loop transfer function, Eq. (2a) with the specimen's stiffness, stands in
    the loop of the partition, whose force is held from sample to sample.

    Args:
        partition: the hybrid test; a YAML file, or the name of one that comes with the package.
        calibration: posterior of the actuator.
        draws: how many of its draws are used, evenly spread over it.
        frequencies: where the actuator's delay and amplitude are told [Hz].
        compensator: 'none'; or 'inverse', the band-limited inverse of the posterior's mean.
        band_hz: where the inverse is 3 dB down [Hz]; None for a fortieth of the sample rate.
        seed: of the specimen's draws, where the partition gives it standard deviations.

    Raises:
        InputError: a partition, posterior or option that cannot be used.

    Example:
        >>> found = rths('benchmark_case_1', posterior)  # doctest: +SKIP
        >>> found.p_unstable.upper  # doctest: +SKIP
    """
    if seed < 0:
        raise InputError(f'seed {seed} is negative')
    started = time.perf_counter()
    if not isinstance(partition, Partition):
        partition = read_partition(partition)
    _check(partition, draws, frequencies, compensator, band_hz)
    posterior = calibration.posterior
    rows = np.linspace(0, len(posterior) - 1, min(draws, len(posterior))).astype(np.intp)
    used = posterior[rows]
    specimen = partition.specimen.drawn(np.random.default_rng(seed), len(used))
    names, effects = calibration.names, calibration.effects
    actuators = actuator(used, names, effects, specimen['stiffness'])
    stiffness = np.array([partition.specimen.stiffness])
    mean = actuator(posterior.mean(axis=0)[None], names, effects, stiffness)
    inverse, described = None, 'none'
    if compensator == 'inverse':
        band = partition.rate / 40.0 if band_hz is None else band_hz
        inverse = inverse_compensator(mean.system, band)
        described = f'inverse of the posterior mean, low-pass at {band:g} Hz'
    loop = stability.loops(partition, specimen, actuators.system, inverse)
    delay = actuators.delay + partition.computation_delay
    growth = stability.growth(loop, partition.period, delay)
    margin = stability.signed_margin(loop, partition.period, delay, growth > 0.0)
    tracking = stability.tracking(actuators, frequencies)
    inputs = {n: used[:, i] for i, n in enumerate(names)}
    inputs |= {f'specimen {n}': column for n, column in specimen.items()}
    sensitive = stability.sensitivity(margin, inputs)
    with_mean = stability.loops(partition, partition.specimen.nominal, mean.system, inverse)
    return StabilityResult(
        partition=partition.name,
        natural_frequencies_hz=tuple(map(float, partition.natural_frequencies)),
        rate_hz=partition.rate,
        delay_margin=DelayMargin(*pure_delay_margin(partition)),
        margins={
            'perfect_actuator': classical_margins(nominal(partition)),
            'mean_actuator': classical_margins(with_mean),
        },
        p_unstable=stability.share(growth > 0.0, _effective(calibration)),
        margin_s=spread(margin) if np.isfinite(margin).all() else None,
        growth_per_s=spread(growth),
        bandwidth_hz=spread(tracking.bandwidth),
        tracking=tuple(
            AtFrequency(float(f), spread(tracking.delay[:, i]), spread(tracking.amplitude[:, i]))
            for i, f in enumerate(frequencies)
        ),
        sensitivity=sensitive,
        most_sensitive=max(sensitive, key=lambda n: abs(sensitive[n]), default=None),
        compensator=described,
        draws=len(used),
        seconds=time.perf_counter() - started,
        problems=calibration.problems,
        notes=tuple(_notes(partition, calibration, loop, mean.delay)),
        margins_drawn=margin,
        growth_drawn=growth,
    )


def spread(values: Array) -> Spread:
    """Return mean, standard deviation and 95 % limits of values (m,)."""
    lower, median, upper = np.quantile(values, (0.025, 0.5, 0.975))
    return Spread(
        float(values.mean()), float(values.std()), float(lower), float(median), float(upper)
    )


def _check(
    partition: Partition,
    draws: int,
    frequencies: Sequence[float],
    compensator: str,
    band_hz: float | None,
) -> None:
    half = 0.5 * partition.rate
    if draws < 2:
        raise InputError(f'{draws} draws are no distribution; use at least 2')
    for f in frequencies:
        if not 0.0 < f <= half:
            raise InputError(f'frequency {f:g} Hz is outside (0, {half:g}] Hz')
    if compensator not in COMPENSATORS:
        raise InputError(
            f'compensator {compensator!r} is unknown; use one of {", ".join(COMPENSATORS)}'
        )
    if band_hz is not None and compensator == 'none':
        raise InputError('a band is given but no compensator; use compensator inverse')
    if band_hz is not None and not 0.0 < band_hz <= half:
        raise InputError(f'band {band_hz:g} Hz is outside (0, {half:g}] Hz')


def _effective(calibration: Calibration) -> float:
    """Return how many independent draws a posterior is worth: those of its worst parameter."""
    sizes = np.array([p.ess for p in calibration.parameters.values()])
    return float(np.nanmin(sizes)) if np.isfinite(sizes).any() else 1.0


def _notes(
    partition: Partition, calibration: Calibration, loop: System, delay: Array
) -> list[str]:
    """Return what limits the answer."""
    notes = []
    if not calibration.converged:
        notes.append('the chains of the posterior have not converged (R-hat above 1.01)')
    known = [s.stiffness_n_per_m for s in calibration.sources if s.stiffness_n_per_m is not None]
    k = partition.specimen.stiffness
    if known and not min(known) <= k <= max(known):
        notes.append(
            f'specimen stiffness {k:g} N/m lies outside those of the calibration '
            f'({min(known):g} to {max(known):g} N/m): Eq. (2) extrapolates'
        )
    if partition.specimen.mass > 0.0:
        notes.append(
            'Eq. (2) takes the specimen as a massless spring; its mass and damping act on the '
            'structure, not on the actuator'
        )
    if float(delay[0]) > 0.0:
        notes.append('gain and phase margin of the mean actuator leave its delay effect out')
    return notes
