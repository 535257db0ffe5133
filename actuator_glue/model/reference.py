"""A rough fit of one record by a second-order system, quickly and from nowhere.

The fast likelihood builds its basis around it and measures errors from it (docs/fast_path.md).
"""

from __future__ import annotations

import numpy as np

from actuator_glue.model import linear
from actuator_glue.model.exact import ExactErrors
from actuator_glue.model.parameters import BASE
from actuator_glue.records import Array, Record

_RATE = 400.0  # Hz; thinned to at least this rate a record still shows the actuator's poles
# Grid: points per axis, refinements, range of the lag [s] and of the frequency [Hz].
_GRID, _LEVELS = 8, 5
_LAG, _FREQUENCY = (3e-4, 3.0), (0.5, 150.0)
_DAMPING = BASE[0].upper + BASE[3].upper  # the largest a1 of the prior [1/s]
_STEPS, _CHANGE = 20, 1e-3  # damped Gauss-Newton steps at most; change of ln S that ends them


def fit(record: Record, settle: int, start: Array) -> Array:
    """Return a1 [1/s], a0 [1/s^2], b0 [1/s^2] near the best fit of one record, shape (3,).

    The static gain b0/a0 is one without a specimen and at most one with it, as in Eq. (2a).

    Args:
        record: with known stiffness.
        settle: samples at the beginning that do not count.
        start: position [m] and velocity [m/s] at the first sample.
    """
    every = max(1, int(record.rate // _RATE))
    thin = _thinned(record, every)
    held = thin.known_stiffness() == 0.0
    count = min(settle // every, len(thin) - 2)
    best = _search(thin, count, start, held)
    return _polish(thin, count, start, held, best)


def _thinned(record: Record, every: int) -> Record:
    if every == 1 or len(record) < 8 * every:
        return record
    u = record.command
    if record.hold == 'zoh':  # on average a held command comes half a sample late
        u = 0.5 * (u + np.concatenate([u[:1], u[:-1]]))
    period = every * record.period
    return Record(u[::every], record.measured[::every], period, record.stiffness, hold='linear')


def _search(record: Record, settle: int, start: Array, held: bool) -> Array:
    """Return the best point of a grid that is drawn ever closer around its best point."""
    measured = ExactErrors([record], settle)
    still = Record(
        record.command, 0.0 * record.measured, record.period, record.stiffness, hold=record.hold
    )
    silent = ExactErrors([still], settle)
    measured.starts = silent.starts = (start,)
    n = len(record) - settle
    m1, m2 = float(record.measured[settle:].sum()), float((record.measured[settle:] ** 2).sum())
    # Lag a1/a0 [s] and frequency sqrt(a0)/(2 pi) [Hz]: what a slow command leaves uncertain is the
    # frequency alone, so that the valley of good fits runs along an axis.
    ends = np.log([_LAG, _FREQUENCY])
    centre, half = ends.mean(axis=1), 0.5 * (ends[:, 1] - ends[:, 0])
    best = np.ones(3)
    for _ in range(_LEVELS):
        axes = centre[:, np.newaxis] + half[:, np.newaxis] * np.linspace(-1.0, 1.0, _GRID)
        points = np.stack(np.meshgrid(*axes)).reshape(2, -1)
        lag, frequency = np.exp(points)
        a0 = np.minimum(2.0 * np.pi * frequency, 2.0 / record.period) ** 2
        systems = np.ascontiguousarray(np.stack([lag * a0, a0, a0], axis=1))
        e, x = measured.of_record(0, systems), silent.of_record(0, systems)
        # Gain profiled out: m'x from (m - x)^2, all about their means.
        with np.errstate(divide='ignore', invalid='ignore'):
            mx = 0.5 * (m2 + x[:, 1] - e[:, 1]) + m1 * x[:, 0] / n
            xx = x[:, 1] - x[:, 0] ** 2 / n
            gain = np.where((mx > 0.0) & (xx > 0.0), mx / xx, 1.0)
            gain = np.ones(len(gain)) if held else np.minimum(gain, 1.0)
            misfit = np.where(lag * a0 <= _DAMPING, gain * (gain * xx - 2.0 * mx), np.inf)
        at = int(np.argmin(np.where(np.isfinite(misfit), misfit, np.inf)))
        best = systems[at] * np.array([1.0, 1.0, gain[at]])
        # Where the best point lies inside the grid, the next one is drawn closer around it.
        inside = np.abs(points[:, at] - centre) < 0.99 * half
        centre, half = points[:, at], np.where(inside, 0.4 * half, half)
    return best


def _polish(record: Record, settle: int, start: Array, held: bool, system: Array) -> Array:
    """Return the end of damped Gauss-Newton steps in ln a1, ln a0 and ln gain."""
    moves = 2 if held else 3
    shift = 1e-4 * np.eye(4, 3, -1)[: moves + 1]
    q = np.log([system[0], system[1], system[2] / system[1]])

    def errors(points: Array) -> Array:
        a1, a0, gain = np.exp(points).T
        x = linear.respond(
            np.stack([a1, a0, gain * a0], axis=1),
            record.command,
            period=record.period,
            hold=record.hold,
            initial=(float(start[0]), float(start[1])),
        )
        e = (record.measured - x)[:, settle:]
        return np.asarray(e - e.mean(axis=1, keepdims=True))

    now = errors(q + shift)
    cost, damping = float((now[0] ** 2).sum()), 1e-3
    for _ in range(_STEPS):
        slopes = (now[1:] - now[0]) / 1e-4
        normal = (slopes[:, np.newaxis] * slopes).sum(axis=2)
        right = (slopes * now[0]).sum(axis=1)
        scale = np.diag(normal) + 1e-300
        step = np.linalg.solve(normal + damping * np.diag(scale), right)
        trial = q.copy()
        trial[:moves] -= np.clip(step, -1.0, 1.0)
        trial[2] = min(trial[2], 0.0)
        trial[0] = min(trial[0], np.log(_DAMPING))
        new = errors(trial + shift)
        found = float((new[0] ** 2).sum())
        if not found < cost:
            damping *= 10.0
            if damping > 1e6:
                break
            continue
        done = found > cost * np.exp(-_CHANGE)
        q, now, cost, damping = trial, new, found, 0.1 * damping
        if done:
            break
    a1, a0, gain = np.exp(q)
    return np.array([a1, a0, gain * a0])
