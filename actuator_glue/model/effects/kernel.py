"""One compiled step of the servo-hydraulic loop with every effect, many parameter sets at once.

Derived in docs/effects_method.md. Per sub-step one scalar equation is solved for the displacement
increment: trapezoidal rule in the valve, the oil and the specimen, then the balance of forces.
Each stage is a loop over lanes that the compiler turns into vector code; a stage whose effects
are off is skipped. Stages that follow one another share a loop only while the processor can look
ahead over several vectors of lanes: one vector alone waits for its own results.

The scheme's own error on the linear model is removed at every step: the exact solution of Eq. (2)
and the scheme's solution of Eq. (2) run along and their difference is added to the displacement.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from actuator_glue.jit import njit
from actuator_glue.model.effects import assembly, balance, command, feedback, lag, stages
from actuator_glue.model.effects import layout as r
from actuator_glue.model.effects.catalogue import specimen_gap, specimen_yield, stribeck_friction
from actuator_glue.model.effects.terms import machine, stage
from actuator_glue.records import Array


@njit
def _touched(w: Array, n: int, dflow: Any, flows: bool) -> Any:
    """One over the stiffness with the specimen; no division where nothing acts on the flow."""
    if flows:
        stiff = w[r.FORCE_X + n] - w[r.FORCE_Q + n] * dflow
        return 1.0 / (stiff + w[r.DAMPING_2 + n] + w[r.STIFFNESS + n])
    acting, idle = w[r.ACTING_TOUCHED + n], w[r.IDLE_TOUCHED + n]
    return acting if dflow != 0.0 else idle


@njit
def _free(w: Array, n: int, dflow: Any, flows: bool) -> Any:
    """One over the stiffness without the specimen."""
    if flows:
        return 1.0 / (w[r.FORCE_X + n] - w[r.FORCE_Q + n] * dflow + w[r.DAMPING_2 + n])
    acting, idle = w[r.ACTING_FREE + n], w[r.IDLE_FREE + n]
    return acting if dflow != 0.0 else idle


@njit
def _flows(w: Array, n: int, mean: float, flows: bool) -> Any:
    """Spool flow and flow into the cylinder, each with its d/d(dx)."""
    if flows:
        return w[r.IN_Q + n], w[r.IN_DQ + n], w[r.IN_FLOW + n], w[r.IN_DFLOW + n]
    q, dq = stages.valve(w, n, mean)
    return q, dq, q, dq


@njit
def _at_once(w: Array, mean: float, rate: float, flows: bool, gaps: bool) -> None:
    """Sub-step against a proportional specimen or a gap."""
    for n in range(r.LANES):
        q, dq, flow, dflow = _flows(w, n, mean, flows)
        push, oil, stiff = stages.drive(w, n, flow, dflow)
        touched = _touched(w, n, dflow, flows)
        if gaps:
            dx = specimen_gap.gapped(w, n, push, stiff, _free(w, n, dflow, flows), touched)
        else:
            dx = balance.proportional(w, n, push, touched)
        stages.finish(w, n, rate, q, dq, push, oil, stiff, dx)


@njit
def _begin(w: Array, mean: float, flows: bool, falls: bool, yields: bool) -> None:
    """Write what drives the piston, and what the step against it begins with."""
    for n in range(r.LANES):
        q, dq, flow, dflow = _flows(w, n, mean, flows)
        push, oil, stiff = stages.drive(w, n, flow, dflow)
        if not flows:
            w[r.IN_Q + n], w[r.IN_DQ + n] = q, dq
        w[r.IN_PUSH + n], w[r.IN_OIL + n], w[r.IN_STIFF + n] = push, oil, stiff
        if falls:
            stribeck_friction.first(w, n, push, _touched(w, n, dflow, flows))
        if yields:
            specimen_yield.halfway(w, n, w[r.DX + n])


@njit
def _end(w: Array, n: int, rate: float, dx: Any) -> None:
    """Finish a sub-step that `_begin` has begun."""
    q, dq, push = w[r.IN_Q + n], w[r.IN_DQ + n], w[r.IN_PUSH + n]
    stages.finish(w, n, rate, q, dq, push, w[r.IN_OIL + n], w[r.IN_STIFF + n], dx)


@njit
def _curved(w: Array, rate: float, yields: bool) -> None:
    """Sub-step against a specimen whose tangent changes slowly: one Newton step."""
    for n in range(r.LANES):
        push, stiff = w[r.IN_PUSH + n], w[r.IN_STIFF + n]
        guess = w[r.DX + n]
        force, tangent = balance.specimen(w, n, guess, False, yields)
        dx = balance.look(w, n, push, stiff, w[r.COULOMB + n], guess, force, tangent)
        if yields:
            specimen_yield.finish(w, n, dx, False)
        _end(w, n, rate, dx)


@njit
def _search(
    w: Array,
    g: Array,
    parts: machine.Parts,
    rate: float,
    falls: bool,
    yields: bool,
    terms: bool,
) -> None:
    """Newton steps: two, three where friction falls, until all settle with `terms`."""
    balance.begin(w, terms)
    for _ in range(balance.MOST if terms else 3 if falls else 2):
        if yields:
            for n in range(r.LANES):
                # A lane that has settled is left as it is, whatever its neighbours need.
                if not terms or w[r.IN_LOW + n] < w[r.IN_HIGH + n]:
                    moved = specimen_gap.passed(w, n, w[r.IN_DX + n], True)
                    specimen_yield.halfway(w, n, moved)
        if terms:
            stage.force(w, g, parts, rate, yields)
        for n in range(r.LANES):
            push, stiff, guess = w[r.IN_PUSH + n], w[r.IN_STIFF + n], w[r.IN_DX + n]
            dry = w[r.COULOMB + n]
            if falls:
                dry += stribeck_friction.rise(w, n, guess)
            if terms:
                # What weakens faster than the oil is stiff is not followed implicitly.
                least = -0.5 * (stiff + w[r.DAMPING_2 + n])
                force, tangent = g[machine.F, n], max(g[machine.D_F, n], least)
            else:
                force, tangent = balance.specimen(w, n, guess, True, yields)
            w[r.IN_DX + n] = balance.look(w, n, push, stiff, dry, guess, force, tangent)
        if terms and balance.settled(w):
            break
    if terms:
        stage.keep(w, g, parts, rate, yields)
    for n in range(r.LANES):
        dx = w[r.IN_DX + n]
        if falls:
            w[stribeck_friction.LEVEL + n] = stribeck_friction.rise(w, n, dx)
        if yields:
            specimen_yield.finish(w, n, dx, True)
        _end(w, n, rate, dx)


@njit
def substep(
    w: Array,
    g: Array,
    parts: machine.Parts,
    on: NDArray[np.bool_],
    mean: float,
    slope: float,
    rate: float,
    time: float,
) -> None:
    """Carry the nonlinear loop on by one sub-step; `time` is its middle."""
    flows, falls, gaps = on[r.ON_FLOW], on[stribeck_friction.ON], on[specimen_gap.ON]
    if on[r.ON_TERMS]:
        flows = stage.before_the_oil(w, g, parts, on, mean, slope, rate, time)
    elif flows:
        for n in range(r.LANES):
            w[r.IN_Q + n], w[r.IN_DQ + n] = stages.valve(w, n, mean)
        stages.flow(w, on, time)
    if on[r.ON_FORCE]:
        if flows:
            _begin(w, mean, True, False, False)
        else:
            _begin(w, mean, False, False, False)
        if falls or on[specimen_yield.ON]:
            _search(w, g, parts, rate, True, True, True)
        elif gaps or on[r.ON_CURVED]:
            _search(w, g, parts, rate, False, False, True)
        else:
            stage.proportional(w, g, parts, rate)
            for n in range(r.LANES):
                _end(w, n, rate, w[r.IN_DX + n])
        return
    if not (falls or on[r.ON_CURVED]):
        if flows:
            if gaps:
                _at_once(w, mean, rate, True, True)
            else:
                _at_once(w, mean, rate, True, False)
        elif gaps:
            _at_once(w, mean, rate, False, True)
        else:
            _at_once(w, mean, rate, False, False)
        return
    if falls and not (gaps or on[r.ON_CURVED]):
        if flows:
            _begin(w, mean, True, True, False)
        else:
            _begin(w, mean, False, True, False)
        for n in range(r.LANES):
            stribeck_friction.following(w, n)
        for n in range(r.LANES):
            _end(w, n, rate, stribeck_friction.last(w, n, w[r.IN_PUSH + n]))
        return
    yields = on[specimen_yield.ON]
    if flows:
        _begin(w, mean, True, False, True)
    elif yields:
        _begin(w, mean, False, False, True)
    else:
        _begin(w, mean, False, False, False)
    if falls:
        if yields:
            _search(w, g, parts, rate, True, True, False)
        else:
            _search(w, g, parts, rate, True, False, False)
    elif gaps:
        if yields:
            _search(w, g, parts, rate, False, True, False)
        else:
            _search(w, g, parts, rate, False, False, False)
    elif yields:
        _curved(w, rate, True)
    else:
        _curved(w, rate, False)


@njit(nogil=True)
def advance(
    table: Array,
    on: NDArray[np.bool_],
    parts: machine.Parts,
    u: Array,
    offset: int,
    begin: int,
    substeps: int,
    period: float,
    linear: bool,
    displacement: Array,
    force: Array,
) -> None:
    """Write the sensed displacement at samples begin, begin+1, ... and carry the state on.

    Args:
        table: (assembly.SIZE + registers,), read and updated; its states stand at sample
            begin - 1, or at sample 0 where begin is 0.
        on: (assembly.SWITCHES,) which stages act.
        parts: code of effects written as expressions, which uses the registers.
        u: command samples [m]; u[0] is sample `offset` of the stream.
        offset: stream index of u[0].
        begin: stream index of the first sample written.
        substeps: sub-steps per sample.
        period: sample period [s].
        linear: whether the command runs linearly between samples (else zero-order hold).
        displacement: (n, LANES) output, recorded displacement before sensor post-steps [m].
        force: (n, LANES) output, actuator force [N]; (0, LANES) where it is not wanted.
    """
    w = np.empty(assembly.SIZE)  # known to the compiler
    w[:] = table[: assembly.SIZE]
    g = table[assembly.SIZE :].reshape(-1, r.LANES)
    places = np.empty(lag.PLACES, np.int32)
    lag.prepare(w, substeps)
    inverse, rate = 1.0 / substeps, 2.0 * substeps / period
    want_force = force.shape[0] > 0
    if begin == 0 and displacement.shape[0] > 0:  # the state as it stands
        for n in range(r.LANES):
            displacement[0, n] = w[r.X + n]
        if on[r.ON_FEEDBACK]:
            for _ in range(2):  # now, and a step before
                feedback.keep(w, g, parts, 0.0, displacement[0])
    for i in range(displacement.shape[0]):
        at = begin + i - 1  # the interval from sample `at` to the sample written now
        for j in range(substeps if at >= 0 else 0):
            mean, slope, start = 0.0, 0.0, at + j * inverse
            if on[r.ON_LAG]:
                if linear:
                    lag.linear(w, places, u, offset, start, inverse)
                else:
                    lag.held(w, places, u, offset, start, inverse)
            elif linear:
                mean, slope = command.linear(u, offset, start, start + inverse)
            else:
                mean = command.held(u, at - offset)
            if on[r.ON_BEYOND]:
                feedback.expect(w)
            substep(w, g, parts, on, mean, slope, rate, (at + (j + 0.5) * inverse) * period)
            if on[r.ON_TRANSDUCER] and on[r.ON_BEYOND]:
                for n in range(r.LANES):
                    displacement[i, n] = assembly.sensed(w, n, stages.chains(w, n, mean, slope))
            elif on[r.ON_TRANSDUCER]:
                for n in range(r.LANES):
                    displacement[i, n] = assembly.shown(w, n, stages.chains(w, n, mean, slope))
            else:
                for n in range(r.LANES):
                    displacement[i, n] = stages.chains(w, n, mean, slope)
            if on[r.ON_FEEDBACK]:
                time = (at + (j + 1.0) * inverse) * period
                feedback.keep(w, g, parts, time, displacement[i])
        if want_force:
            for n in range(r.LANES):
                force[i, n] = w[r.F + n]
    table[: assembly.SIZE] = w
