"""Streams whose truth is known: what is hidden in each, how large, since when, what is known."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy

from actuator_glue.api.simulation import sizes
from actuator_glue.inference.carried import Carried
from actuator_glue.model import commands, linear
from actuator_glue.model.parameters import NAMES
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array, Record

RATE, NOISE, STIFFNESS = 200.0, 1e-5, 250e3
# So large that the hardest specimen of the catalogue is clear, too [m].
PEAK = 3e-3
# Single effects, and pairs that do not stand for each other.
EFFECTS = (
    'backlash',
    'coulomb-friction',
    'valve-deadband',
    'delay',
    'gain',
    'gain-drift',
    'specimen-hardening',
    'flow-asymmetry',
    'specimen-gap',
    'flow-saturation',
    'payload-inertia',
    'bias',
)
PAIRS = (('backlash', 'gain-drift'), ('coulomb-friction', 'flow-asymmetry'))
KNOWN = 0.01  # relative standard deviation of what a calibration knows
START_NS = 10**18
# Sizes that are tried, in times of what is typical; how far from neutral to a bound they may go.
_TIMES, _INSIDE = np.geomspace(0.05, 200.0, 24), 0.8


class NotBuiltError(ValueError):
    """No size of the effects inside their bounds leaves as much as is wanted."""


@dataclass(frozen=True)
class Case:
    """One stream.

    Attributes:
        effects: what is hidden.
        ratio: rms that a refitted Eq. (2) leaves of it over the sensor noise.
        calibrated: whether the estimator begins with a calibration.
        onset: when the effects begin [s].
        drift: growth of alpha_1 beta_0 in the stream, as a share of itself.
        seconds: length [s].
        seed: seed of plant, command, noise.
    """

    effects: tuple[str, ...] = ()
    ratio: float = 2.0
    calibrated: bool = True
    onset: float = 0.0
    drift: float = 0.0
    seconds: float = 120.0
    seed: int = 0


@dataclass(frozen=True)
class Streamed:
    """A stream and its truth.

    Attributes:
        record: what is streamed.
        theta: parameters of Eq. (2), (4,).
        sizes: parameters of the effects.
        carried: what a calibration knows; None for nothing.
    """

    record: Record
    theta: Array
    sizes: dict[str, float]
    carried: Carried | None


def streamed(case: Case) -> Streamed:
    """Simulate a case."""
    rng = np.random.default_rng([case.seed, 7])
    theta = np.array([134.0, 1.1e9, 2.5e5, 0.5])
    theta *= np.exp([0.1, 0.1, 0.1, 0.3] * rng.standard_normal(4))
    command = commands.noise(RATE, case.seconds, 0.2, 8.0, seed=case.seed)
    command *= PEAK / np.abs(command).max()
    rest = Record(command, command, 1.0 / RATE, STIFFNESS, start_ns=START_NS)
    plain = linear.simulate(theta, command, stiffness=STIFFNESS, period=1.0 / RATE)
    clean, found = plain, {}
    if case.effects:
        structure, values = _sized(case, theta, rest)
        clean = structure.simulate(_from_onset(structure, values, case.onset), rest)
        found = dict(zip(structure.names[4:], values[4:].tolist(), strict=True))
    if case.drift:
        # A slow change is a sequence of steady states.
        later = theta * [1.0, 1.0 + case.drift, 1.0, 1.0]
        share = np.linspace(0.0, 1.0, len(command))
        moved = linear.simulate(later, command, stiffness=STIFFNESS, period=1.0 / RATE)
        clean = clean + share * (moved - plain)
    since = np.arange(len(command)) / RATE >= case.onset
    clean = np.where(since, clean, plain)
    measured = clean + NOISE * rng.standard_normal(len(clean))
    carried = None
    if case.calibrated:
        middle = theta * np.exp(KNOWN * rng.standard_normal(4))
        carried = Carried(NAMES, middle * np.exp(KNOWN * rng.standard_normal((400, 4))))
    return Streamed(replace(rest, measured=measured), theta, found, carried)


def _from_onset(structure: Structure, values: Array, onset: float) -> Array:
    """Return parameters (p,) with which a gain that drifts is what it was when it begins to."""
    if 'gain_drift' not in structure.names:
        return values
    out, rate = values.copy(), structure.names.index('gain_drift')
    out[1] *= 1.0 - values[rate] * onset
    out[rate] /= 1.0 - values[rate] * onset
    return out


def _sized(case: Case, theta: Array, rest: Record) -> tuple[Structure, Array]:
    """Return effects of the smallest size of which a refitted Eq. (2) leaves the ratio wanted.

    Raises:
        NotBuiltError: none inside the bounds does.
    """
    structure, typical = sizes(case.effects, theta)
    neutral, wanted = structure.neutral(theta), case.ratio * NOISE
    bounds = np.array([(p.lower, p.upper) for p in structure.parameters]).T
    # A truth at a bound is none that an interval may be asked to hold.
    lower, upper = neutral + _INSIDE * (bounds - neutral)
    # What limits a motion is neutral where nothing reaches it: half as much is twice the effect.
    limits = (typical > 0.0) & (typical < neutral)
    lower[limits] = bounds[0, limits] / _INSIDE

    def scaled(times: float) -> Array:
        found = neutral + times * (typical - neutral)
        most = 1.0 / neutral[limits]
        share = np.maximum(times, 0.0)
        found[limits] = 1.0 / (most + share * (1.0 / typical[limits] - most))
        return np.clip(found, lower, upper)

    def leaves(times: float) -> float:
        return left(structure.simulate(scaled(times), rest), theta, rest)

    # Some have a direction that leaves less than is wanted, wherever it ends.
    for direction in (1.0, -1.0):
        low = 0.0
        for high in _TIMES:
            if leaves(direction * high) >= wanted:
                for _ in range(10):
                    middle = 0.5 * (low + high)
                    small = leaves(direction * middle) < wanted
                    low, high = (middle, high) if small else (low, middle)
                return structure, scaled(direction * high)
            low = high
    raise NotBuiltError(f'{case}: no size inside the bounds leaves so much')


def left(clean: Array, theta: Array, part: Record) -> float:
    """Return the rms that a refitted Eq. (2) leaves of a response [m]."""

    def error(logs: Array) -> Array:
        response = linear.simulate(
            theta * np.exp(np.clip(logs, -3.0, 3.0)),
            part.command,
            stiffness=STIFFNESS,
            period=part.period,
        )
        return np.asarray((clean - response)[100:] / NOISE)

    # alpha_2 is open at one stiffness.
    fit = scipy.optimize.least_squares(
        lambda x: error(np.array([x[0], x[1], 0.0, x[2]])), np.zeros(3), max_nfev=20
    )
    return float(NOISE * np.sqrt(np.mean(fit.fun**2)))


def few(seed: int, seconds: float) -> list[Case]:
    """Return each effect once, every second one without calibration, and two healthy streams."""
    found = [
        Case((name,), 2.0 + 2.0 * (i % 3 == 0), i % 2 == 0, seconds=seconds, seed=seed + i)
        for i, name in enumerate(EFFECTS)
    ]
    return found + [Case(seconds=seconds, calibrated=c, seed=seed + 90 + c) for c in (True, False)]


def all_cases(seed: int) -> list[Case]:
    """Return the 300 streams: effects at two sizes, pairs, drifts, healthy machines."""
    hidden = [(name,) for name in EFFECTS] + [*PAIRS]
    found = [
        Case(names, ratio, calibrated, onset, seed=0)
        for names in hidden
        for ratio in (2.0, 4.0)
        for calibrated in (True, False)
        for onset in (0.0, 45.0)
        for _ in range(2)
    ]
    found += [Case(calibrated=c, drift=0.03, seed=0) for c in (True, False) for _ in range(13)]
    found += [Case(calibrated=c, seed=0) for c in (True, False) for _ in range(25)]
    return [replace(case, seed=seed + i) for i, case in enumerate(found)]
