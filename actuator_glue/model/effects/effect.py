"""What an entry of the effect catalogue says."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from actuator_glue.model.effects.stage import Stage
from actuator_glue.model.effects.terms.expression import Expression, Place
from actuator_glue.model.parameters import Parameter
from actuator_glue.records import Array, Record


@dataclass(frozen=True, slots=True)
class Scale:
    """Sizes of a test that tell how large an effect must be to be seen.

    Attributes:
        stroke: largest command from its median [m].
        velocity: 99 % quantile of the measured speed over 20 ms [m/s].
        duration: longest record [s].
        period: shortest sample period [s].
        stiffness: largest specimen stiffness [N/m].
        theta: base parameters of Eq. (2), shape (4,).
    """

    stroke: float
    velocity: float
    duration: float
    period: float
    stiffness: float
    theta: Array

    @property
    def oil(self) -> float:
        """Stiffness a suddenly moved piston meets, alpha_2 + k [N/m]."""
        return float(self.theta[2]) + self.stiffness


def scale(records: Sequence[Record], theta: Array) -> Scale:
    """Return the scale of a set of records at base parameters theta (4,)."""
    strokes, speeds = [], []
    for r in records:
        strokes.append(float(np.abs(r.command - np.median(r.command)).max()))
        gap = max(1, round(0.02 / r.period))
        if len(r) > gap:
            speed = np.abs(r.measured[gap:] - r.measured[:-gap]) / (gap * r.period)
            speeds.append(float(np.quantile(speed, 0.99)))
    return Scale(
        stroke=max([*strokes, 1e-6]),
        velocity=max([*speeds, 1e-6]),
        duration=max(r.duration for r in records),
        period=min(r.period for r in records),
        stiffness=max(r.known_stiffness() for r in records),
        theta=np.asarray(theta, dtype=np.float64)[:4],
    )


Starts: TypeAlias = Callable[[Scale], Sequence[Sequence[float]]]
Output: TypeAlias = Callable[[Array, Array, Array], Array]
Variance: TypeAlias = Callable[[Array, Array], Array]
# From parameters by name, each (m,), and the time of a record's first sample since the test began
# [s]: the parameters that are different there, and further values that are known.
Onset: TypeAlias = Callable[[Mapping[str, Array], float], Mapping[str, Array]]


@dataclass(frozen=True, slots=True)
class Effect:
    """One physical effect that Eq. (2) lacks.

    Attributes:
        name: name on the command line.
        place: where in the loop it acts.
        equation: what it changes, in the symbols of docs/effects_catalogue.md.
        parameters: what can be estimated; all at `neutral` switch the effect off. A parameter
            that only shapes the effect has a neutral value that is merely a default.
        group: effects of one group leave nearly the same trace in command and displacement.
        signature: what it leaves in the residual.
        source: literature.
        meaning: what it is to a mechanic, in a sentence without a full stop.
        remedy: what to check or to do about it, likewise.
        starts: sizes from which a fit may start, given the scale of the test; each row holds
            one value per parameter.
        exact: states it needs beside x and q in the exact simulation (linear_effects.py), where
            it is linear.
        stage: what it does in the compiled step.
        onset: what depends on where a record begins, given the record if it begins in motion.
        states: what `onset` gives its stage beside parameters.
        output: post-step on the recorded displacement: (parameters (m, p), time (n, 1),
            displacement (n, m)) -> (n, m).
        variance: variance it adds to the measurement: (parameters (m, p), velocity of the
            recorded displacement (m, n) [m/s]) -> (m, n) [m^2]; such an effect leaves the mean.
        expression: what it does to the signal of its place, where the compiled step has no stage
            of its own for it (see terms.term).
        searched: whether the diagnosis tries it.
        reserved: it is tried only where all others leave material structure.
        holds: the effect of which it is a richer form, and the parameter and its value at which
            it is that effect.
        record_time: its time counts from a record's first sample, wherever in the test that lies:
            no stretch of a record can stand for the record.
    """

    name: str
    place: Place
    equation: str
    parameters: tuple[Parameter, ...]
    group: str
    signature: str
    source: str
    starts: Starts
    meaning: str = ''
    remedy: str = ''
    exact: tuple[int, ...] | None = None
    stage: Stage | None = None
    onset: Callable[[Record | None], Onset | None] | None = None
    states: tuple[str, ...] = ()
    output: Output | None = None
    variance: Variance | None = None
    expression: Expression | None = None
    searched: bool = True
    reserved: bool = False
    holds: tuple[str, str, float] | None = None
    record_time: bool = False

    @property
    def linear(self) -> bool:
        """Whether it leaves the loop linear, so that linear_effects.py simulates it exactly."""
        return self.exact is not None or self.output is not None or self.variance is not None
