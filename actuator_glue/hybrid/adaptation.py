"""The adaptive time series: coefficients that follow the measured displacement, compiled.

Chae, Kazemibidokhti and Ricles 2013: over a moving window the command is regressed on the measured
displacement, its rate and its acceleration; the same coefficients on the target then make it
arrive. Both pass one low-pass, whose states are the derivatives, so that neither lags the other.
"""

from __future__ import annotations

import math

import numpy as np

from actuator_glue.hybrid.compensator import HIGHEST, LOWEST
from actuator_glue.jit import njit
from actuator_glue.model.effects.layout import LANES
from actuator_glue.records import Array

WINDOW = 1.0  # s
_PARTS = 16  # the window moves on by one of these
_BAND = (
    1.5  # times the lowest natural frequency: the low-pass, above which three terms fit nothing
)
_RIDGE = 1e-3  # share of the window's information that the first coefficients count for
_SMALLEST = 6.0  # times the noise: below this rms displacement nothing is learned

# Rows of a lane's memory: low-passed displacement and rate, of measured and of command; first
# coefficients; present slopes of the coefficients; sums of the part; sums of all parts.
_STATES, FIRST, _SLOPE, _NOW, _KEPT = 0, 4, 7, 10, 20
_SUMS = 10  # 6 of the normal matrix, 3 of the right side, one spare for alignment
ROWS = _KEPT + _PARTS * _SUMS
_LOW = (float(LOWEST[0]), float(LOWEST[1]), float(LOWEST[2]))
_HIGH = (float(HIGHEST[0]), float(HIGHEST[1]), float(HIGHEST[2]))


def smoothing(period: float, noise: float, lowest_hz: float) -> Array:
    """Return what `follow` needs of a loop, (9,).

    Args:
        period: sample period [s].
        noise: of the displacement sensor, standard deviation [m].
        lowest_hz: lowest natural frequency of the structure [Hz].
    """
    from scipy.linalg import expm

    w = 2.0 * math.pi * _BAND * lowest_hz
    block = np.zeros((3, 3))
    block[0, 1], block[1, 0], block[1, 1] = 1.0, -(w**2), -math.sqrt(2.0) * w
    block[1, 2] = w**2
    over = expm(block * period)
    part = max(1.0, round(WINDOW / _PARTS / period))
    return np.concatenate(
        [over[:2].ravel(), [w**2, part, (_SMALLEST * noise) ** 2 * _PARTS * part]]
    )


@njit
def _lowpass(how: Array, memory: Array, row: int, n: int, new: float) -> tuple[float, ...]:
    """Move one low-pass on; return its output, rate and acceleration, scaled."""
    x, v = memory[row, n], memory[row + 1, n]
    after = how[0] * x + how[1] * v + how[2] * new
    speed = how[3] * x + how[4] * v + how[5] * new
    memory[row, n], memory[row + 1, n] = after, speed
    w = math.sqrt(how[6])
    # In units of the low-pass's frequency, which makes the three of like size.
    return after, speed / w, new - after - math.sqrt(2.0) * speed / w


@njit
def follow(i: int, how: Array, measured: Array, command: Array, memory: Array, ats: Array) -> None:
    """Take sample i in; renew the coefficients (3, LANES) at the end of each part of the window.

    Args:
        i: sample.
        how: `smoothing`.
        measured: displacement, (LANES,) [m].
        command: (LANES,) [m].
        memory: (ROWS, LANES), zero but for the first coefficients at rows FIRST.
        ats: coefficients, changed.
    """
    part = int(how[7])
    for n in range(LANES):
        x, v, a = _lowpass(how, memory, _STATES, n, measured[n])
        u = _lowpass(how, memory, _STATES + 2, n, command[n])[0]
        memory[_NOW, n] += x * x
        memory[_NOW + 1, n] += x * v
        memory[_NOW + 2, n] += x * a
        memory[_NOW + 3, n] += v * v
        memory[_NOW + 4, n] += v * a
        memory[_NOW + 5, n] += a * a
        memory[_NOW + 6, n] += x * u
        memory[_NOW + 7, n] += v * u
        memory[_NOW + 8, n] += a * u
        for c in range(3):  # in steps too small to jolt the piston
            ats[c, n] += memory[_SLOPE + c, n]
    if (i + 1) % part:
        return
    place = _KEPT + ((i + 1) // part) % _PARTS * _SUMS
    for j in range(9):
        for n in range(LANES):
            memory[place + j, n], memory[_NOW + j, n] = memory[_NOW + j, n], 0.0
    for n in range(LANES):
        _renew(how, memory, ats, n)


@njit
def _renew(how: Array, memory: Array, ats: Array, n: int) -> None:
    """Solve one lane's regression; its coefficients are reached over the next part."""
    total = np.zeros(9)
    for k in range(_PARTS):
        for j in range(9):
            total[j] += memory[_KEPT + k * _SUMS + j, n]
    a, b, c, d, e, f = total[0], total[1], total[2], total[3], total[4], total[5]
    if not a > how[8]:
        for j in range(3):
            memory[_SLOPE + j, n] = 0.0
        return
    w = math.sqrt(how[6])
    ridge = _RIDGE * (a + d + f) / 3.0
    g0, g1, g2 = (
        total[6] + ridge * memory[FIRST, n],
        total[7] + ridge * memory[FIRST + 1, n] * w,
        total[8] + ridge * memory[FIRST + 2, n] * how[6],
    )
    a, d, f = a + ridge, d + ridge, f + ridge
    # Cramer's rule: symmetric and well conditioned by the ridge.
    m0, m1, m2 = d * f - e * e, c * e - b * f, b * e - c * d
    determinant = a * m0 + b * m1 + c * m2
    new = (
        (m0 * g0 + m1 * g1 + m2 * g2) / determinant,
        (m1 * g0 + (a * f - c * c) * g1 + (b * c - a * e) * g2) / determinant / w,
        (m2 * g0 + (b * c - a * e) * g1 + (a * d - b * b) * g2) / determinant / how[6],
    )
    for j in range(3):
        limited = min(max(new[j], _LOW[j]), _HIGH[j])
        memory[_SLOPE + j, n] = (limited - ats[j, n]) / how[7]
