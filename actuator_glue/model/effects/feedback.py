"""Feedback through the recorded transducer: what the controller reads beyond the position."""

from __future__ import annotations

from actuator_glue.jit import njit
from actuator_glue.model.effects import assembly
from actuator_glue.model.effects import layout as r
from actuator_glue.model.effects.terms import machine
from actuator_glue.records import Array


@njit
def expect(w: Array) -> None:
    """Write the control error's offset in the middle of the step to come.

    The recorded transducer goes on as it did: the error is of second order in the step.
    """
    for n in range(r.LANES):
        share, now = w[r.FEEDBACK + n], w[r.BEYOND + n]
        recorded = now + 0.5 * (now - w[r.BEYOND_BEFORE + n]) + w[r.HELD + n]
        shown = (1.0 - share) * assembly.beyond(w, n) + share * recorded
        w[r.NULL + n] = w[r.NULL_ALONE + n] - shown


@njit
def keep(w: Array, g: Array, parts: machine.Parts, time: float, sensed: Array) -> None:
    """Keep what the recorded transducer shows beyond the piston's position.

    Args:
        w: table.
        g: registers of the program.
        parts: code of effects written as expressions, those of the sensor among them.
        time: of the end of the step, from the first sample [s].
        sensed: what compiled effects have made of the position, (LANES,) [m].
    """
    for n in range(r.LANES):
        g[machine.Y, n] = sensed[n]
    for n in range(r.LANES):
        g[machine.T, n] = time + g[machine.ORIGIN, n]
    if parts[machine.SENSOR]:
        machine.execute(parts[machine.SENSOR], g, w)
    for n in range(r.LANES):
        w[r.BEYOND_BEFORE + n] = w[r.BEYOND + n]
        w[r.BEYOND + n] = g[machine.Y, n] - (w[r.X + n] + w[r.X_EXACT + n] - w[r.X_TRAP + n])
