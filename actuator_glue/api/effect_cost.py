"""What effects of the model cost of a hybrid test's delay margin."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from actuator_glue.api.drawn import evenly
from actuator_glue.api.spread import Spread, spread
from actuator_glue.hybrid import sampled, stability
from actuator_glue.hybrid.actuator import actuator, inside, nonlinear
from actuator_glue.hybrid.compensator import Compensator
from actuator_glue.hybrid.describing import force_ratio
from actuator_glue.hybrid.design import Loop
from actuator_glue.hybrid.linear_system import System
from actuator_glue.hybrid.margin import critical_frequency, sampled_delay_margin
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array

_DRAWS = 50  # for nonlinear effects, which are simulated
_ROUNDS = 2  # of frequency and describing function


def effect_costs(
    loop: Loop, chosen: Compensator, margin: Array, amplitude: float
) -> dict[str, Spread]:
    """Return how much of the delay margin each effect of the model costs [s].

    The margin of each draw with this effect at its neutral value less that with all of them, under
    the same compensator; negative where the effect makes room. An effect has no number if a draw
    has no limit with or without it. A nonlinear effect is replaced by the gain and the delay of
    its describing function where the loop has its margin.

    Args:
        loop: partition and draws.
        chosen: the compensator.
        margin: of each draw with its linear effects, (m,) [s].
        amplitude: of a sine that moves the actuator as the test does [m]; 0 leaves nonlinear
            effects out.
    """
    structure = Structure(loop.effects)
    neutral = structure.neutral(loop.draws[:, :4])
    names, out = list(loop.names), {}
    for entry in structure.entries:
        if not entry.linear or entry.place == 'sensor':
            continue
        without = loop.draws.copy()
        for name in (p.name for p in entry.parameters):
            without[:, names.index(name)] = neutral[:, structure.names.index(name)]
        plain = replace(
            loop,
            draws=without,
            actuators=actuator(without, names, loop.effects, loop.specimen['stiffness']),
        )
        cost = _less(margins(plain, chosen)[0], margin)
        if np.isfinite(cost).all():
            out[entry.name] = spread(cost)
    if amplitude > 0.0:
        out |= _nonlinear(loop, chosen, amplitude)
    return out


def margins(loop: Loop, chosen: Compensator) -> tuple[Array, Array]:
    """Return the delay margin of each draw [s], and its growth [1/s], (m,) each."""
    partition = loop.partition
    growth = sampled.growth(loop.numerical, loop.plants, chosen.coefficients, partition.period)
    whole = stability.loops(partition, loop.specimen, loop.actuators.system, chosen)
    delay = loop.actuators.delay + partition.computation_delay
    return stability.signed_margin(whole, partition.period, delay, growth > 0.0), growth


def _less(without: Array, margin: Array) -> Array:
    """Return a difference of margins, (m,) [s]; not-a-number of two that have no limit."""
    with np.errstate(invalid='ignore'):
        return without - margin


def _nonlinear(loop: Loop, chosen: Compensator, amplitude: float) -> dict[str, Spread]:
    """Return the cost of each nonlinear effect that moves the piston [s]."""
    moving = inside(loop.effects)
    curved = nonlinear(moving)
    if not curved:
        return {}
    rows = evenly(np.arange(len(loop.draws)), _DRAWS)
    partition, draws = loop.partition, loop.draws[rows]
    specimen = {name: column[rows] for name, column in loop.specimen.items()}
    system = System(*(part[rows] for part in loop.actuators.system))
    linear = stability.loops(partition, specimen, system, chosen)
    late = loop.actuators.delay[rows] + partition.computation_delay + 0.5 * partition.period
    nominal = {name: float(np.median(column)) for name, column in specimen.items()}
    w = float(np.median(critical_frequency(linear, partition.period, late)))
    if not np.isfinite(w):
        return {}

    def margin_with(effects: list[str]) -> Array:
        at = w
        for _ in range(_ROUNDS):
            motion = at / (2.0 * np.pi), amplitude
            found = force_ratio(draws, loop.names, effects, nominal, motion)
            gain, delay = np.abs(found), late - np.angle(found) / at
            scaled = System(linear.A, linear.B, linear.C * gain[:, None], linear.D * gain)
            at = float(np.median(critical_frequency(scaled, partition.period, delay)))
            if not np.isfinite(at):
                return np.full(len(rows), np.nan)
        later, sooner = sampled_delay_margin(scaled, partition.period, delay)
        return np.where(sooner < later, -sooner, later)

    out, whole = {}, margin_with(moving)
    for name in curved:
        cost = _less(margin_with([n for n in moving if n != name]), whole)
        if np.isfinite(cost).all():
            out[name] = spread(cost)
    return out
