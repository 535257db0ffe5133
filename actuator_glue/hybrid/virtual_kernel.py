"""A virtual hybrid test, compiled: structure, compensator and actuator sample by sample.

Everything is an array with one column per lane, and a lane is one draw of the posterior.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from actuator_glue.hybrid import adaptation
from actuator_glue.hybrid.sampled import Numerical
from actuator_glue.hybrid.virtual_lanes import Found, Lanes, SharedInputs
from actuator_glue.jit import njit
from actuator_glue.model.effects import assembly, kernel, stages
from actuator_glue.model.effects import layout as r
from actuator_glue.model.effects.terms import machine
from actuator_glue.records import Array

LANES = r.LANES


@njit
def _observe(i: int, stride: int, z: Array, whole: Array, moved: Array, found: Found) -> None:
    """Note the response at sample i."""
    floors = len(z) // 2
    for d in range(floors):
        for n in range(LANES):
            x, perfect = z[d, n], whole[d, n]
            error = x - perfect
            below = z[d - 1, n] if d > 0 else 0.0
            found.sums[0, d, n] += error * error
            found.sums[1, d, n] += perfect * perfect
            found.peaks[0, d, n] = max(found.peaks[0, d, n], abs(error))
            found.peaks[1, d, n] = max(found.peaks[1, d, n], abs(perfect))
            found.peaks[2, d, n] = max(found.peaks[2, d, n], abs(x))
            found.peaks[3, d, n] = max(found.peaks[3, d, n], abs(x - below))
        if i % stride == 0:
            for n in range(LANES):
                found.response[i // stride, d, n] = z[d, n]
                found.whole[i // stride, d, n] = whole[d, n]
    for n in range(LANES):
        found.moved[n, i] = moved[n]


@njit
def _command(
    structure: Numerical, z: Array, force: Array, ground: float, ats: Array, u: Array
) -> None:
    """Write the command of each lane from the target, its rate and its acceleration."""
    s = len(z)
    at = structure.interface
    row = structure.acceleration
    for n in range(LANES):
        u[n] = row[s] * force[n] + row[s + 1] * ground
    for j in range(s):
        for n in range(LANES):
            u[n] += row[j] * z[j, n]
    for n in range(LANES):
        u[n] = ats[0, n] * z[at, n] + ats[1, n] * z[s // 2 + at, n] + ats[2, n] * u[n]


@njit
def _respond(
    structure: Numerical,
    lanes: Lanes,
    ground: float,
    force: Array,
    z: Array,
    whole: Array,
    new: Array,
) -> None:
    """Carry numerical substructure and reference on by one sample."""
    s = len(z)
    for i in range(s):
        for n in range(LANES):
            new[i, n] = structure.force[i] * force[n] + structure.ground[i] * ground
        for j in range(s):
            for n in range(LANES):
                new[i, n] += structure.step[i, j] * z[j, n]
    z[:] = new
    for i in range(s):
        for n in range(LANES):
            new[i, n] = lanes.ground[i, n] * ground
        for j in range(s):
            for n in range(LANES):
                new[i, n] += lanes.reference[i, j, n] * whole[j, n]
    whole[:] = new


@njit
def _force(
    lanes: Lanes, own: Array, speed: Array, before: Array, period: float, out: Array
) -> None:
    """Write the specimen's force: what the spring gives, its damper, its inertia."""
    for n in range(LANES):
        damper = lanes.specimen[1, n] * speed[n]
        out[n] = own[n] + damper + lanes.specimen[2, n] * (speed[n] - before[n]) / period
        before[n] = speed[n]


@njit
def _sensed(out: Array, true: Array, deviation: float, rng: Any) -> None:
    for n in range(LANES):
        out[n] = true[n]
    if deviation > 0.0:
        for n in range(LANES):
            out[n] += deviation * rng.standard_normal()


@njit
def _exchange(
    i: int,
    structure: Numerical,
    lanes: Lanes,
    course: SharedInputs,
    rng: Any,
    z: Array,
    whole: Array,
    ats: Array,
    memory: Array,
    work: Array,
    found: Found,
) -> None:
    """Do all of a sample but the actuator: from its motion and force to its next command.

    The rows of `work` are the lanes' displacement, recorded displacement, spring force, velocity,
    velocity one sample ago, force, measured force, measured displacement, command.
    """
    ground = course.ground[i]
    _force(lanes, work[2], work[3], work[4], course.period, work[5])
    _sensed(work[6], work[5], course.noise[1], rng)
    for n in range(LANES):
        found.target[n, i] = z[structure.interface, n]
        found.force[n] = max(found.force[n], abs(work[5, n]))
    _observe(i, course.stride, z, whole, work[0], found)
    _command(structure, z, work[6], ground, ats, work[8])
    if course.adaptive:
        _sensed(work[7], work[1], course.noise[0], rng)
        adaptation.follow(i, course.smoothing, work[7], work[8], memory, ats)
    _respond(structure, lanes, ground, work[6], z, whole, work[9:])


@njit(nogil=True)
def run_linear(
    structure: Numerical, lanes: Lanes, course: SharedInputs, ats: Array, rng: Any, found: Found
) -> None:
    """Run a block of linear actuators through the record.

    Args:
        structure: numerical substructure.
        lanes: actuators and reference structures.
        course: ground motion, noise.
        ats: coefficients of the compensator, (3, LANES); adapted ones are written here.
        rng: of the sensors' noise.
        found: receives the response; sums and peaks zero.
    """
    s, p = len(structure.step), len(lanes.command)
    z, whole, work = np.zeros((s, LANES)), np.zeros((s, LANES)), np.zeros((9 + s, LANES))
    state, new = np.zeros((p, LANES)), np.zeros((p, LANES))
    memory = np.zeros((adaptation.ROWS, LANES))
    memory[adaptation.FIRST : adaptation.FIRST + 3] = ats
    for i in range(len(course.ground)):
        for n in range(LANES):
            work[0, n] = state[0, n]
            work[2, n] = lanes.specimen[0, n] * state[0, n]
            work[1, n] = work[3, n] = 0.0
        for j in range(p):
            for n in range(LANES):
                work[1, n] += lanes.shown[j] * state[j, n]
                work[3, n] += lanes.speed[j, n] * state[j, n]
        _exchange(i, structure, lanes, course, rng, z, whole, ats, memory, work, found)
        for k in range(p):
            for n in range(LANES):
                new[k, n] = lanes.command[k, n] * work[8, n]
            for j in range(p):
                for n in range(LANES):
                    new[k, n] += lanes.step[k, j, n] * state[j, n]
        state[:] = new


@njit(nogil=True)
def run_effects(
    structure: Numerical,
    lanes: Lanes,
    course: SharedInputs,
    ats: Array,
    rng: Any,
    found: Found,
    on: NDArray[np.bool_],
    parts: machine.Parts,
    substeps: int,
) -> None:
    """Run a block of actuators with any effects, as `run_linear`.

    Args:
        structure: numerical substructure.
        lanes: actuators and reference structures.
        course: ground motion, noise.
        ats: coefficients, (3, LANES).
        rng: of the sensors' noise.
        found: receives the response.
        on: which stages act, (assembly.SWITCHES,).
        parts: effects written as expressions.
        substeps: of a sample.
    """
    s = len(structure.step)
    z, whole, work = np.zeros((s, LANES)), np.zeros((s, LANES)), np.zeros((9 + s, LANES))
    memory = np.zeros((adaptation.ROWS, LANES))
    memory[adaptation.FIRST : adaptation.FIRST + 3] = ats
    w = np.empty(assembly.SIZE)  # known to the compiler
    w[:] = lanes.table[: assembly.SIZE]
    g = lanes.table[assembly.SIZE :].reshape(-1, LANES)
    past = 1
    while past < lanes.lag.max() + 4.0:
        past *= 2
    commands = np.zeros((past, LANES))
    before = np.zeros((2, LANES))
    inverse, rate = 1.0 / substeps, 2.0 * substeps / course.period
    for i in range(len(course.ground)):
        for n in range(LANES):
            x = work[0, n]
            # Backward difference of second order.
            work[3, n] = (1.5 * x - 2.0 * before[0, n] + 0.5 * before[1, n]) / course.period
            before[1, n], before[0, n] = before[0, n], x
            work[2, n] = w[r.R + n]
        _exchange(i, structure, lanes, course, rng, z, whole, ats, memory, work, found)
        commands[i % past] = work[8]
        for j in range(substeps):
            for n in range(LANES):
                start = i + j * inverse - lanes.lag[n]
                stop = start + inverse
                first, last = math.floor(start), math.floor(stop)
                share = (stop - last) * substeps if last > first else 0.0
                left = commands[first % past, n] if first >= 0 else 0.0
                right = commands[last % past, n] if last >= 0 else 0.0
                jump = (right - left) if share > 0.0 else 0.0
                w[r.IN_MEAN + n] = left + jump * share
                w[r.IN_JUMP + n], w[r.IN_SHARE + n] = jump, share
                w[r.IN_SLOPE + n] = 6.0 * jump * share * (1.0 - share)
            time = (i + (j + 0.5) * inverse) * course.period
            kernel.substep(w, g, parts, on, 0.0, 0.0, rate, time)
            for n in range(LANES):
                corrected = stages.chains(w, n, 0.0, 0.0)
                work[0, n] = work[1, n] = corrected
                if on[r.ON_TRANSDUCER]:
                    work[1, n] = assembly.sensed(w, n, corrected)


@njit(nogil=True)
def climb(target: Array, moved: Array, step: int, lags: Array) -> None:
    """Move the lag of each row, (m,) [samples], up its cross-correlation to the next summit.

    Args:
        target: displacements asked for, (m, n) [m].
        moved: displacements reached, (m, n) [m].
        step: samples of the first step, which halve down to one; 0 leaves the lags as they are.
            Longer ones than a quarter of the shortest period leap to another summit.
        lags: where to begin, and what is found; NaN stays.
    """
    for row in range(len(target)):
        if np.isnan(lags[row]):
            continue
        best, reach = int(lags[row]), step
        height = _correlation(target[row], moved[row], best)
        while reach > 0:
            while True:
                up = _correlation(target[row], moved[row], best + reach)
                down = _correlation(target[row], moved[row], best - reach)
                if not max(up, down) > height:
                    break
                best, height = (best + reach, up) if up > down else (best - reach, down)
            reach //= 2
        lags[row] = best


@njit
def _correlation(target: Array, moved: Array, lag: int) -> float:
    total = 0.0
    n = len(target) - abs(lag)
    if n <= 0:
        return -np.inf
    first, second = max(-lag, 0), max(lag, 0)
    for i in range(n):
        total += target[first + i] * moved[second + i]
    return total
