"""What each operation of the machine computes, as formulas of lanes.

They are elementary functions, too, of a few operations that every lane takes alike.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final

from actuator_glue.model.effects.terms import machine as m
from actuator_glue.model.effects.terms.lanes import WHOLE, LaneNumbers

# Of what remembers, see REMEMBERING.
Remembered = tuple[LaneNumbers, LaneNumbers, LaneNumbers, LaneNumbers]
# Coefficients of the Taylor series of exp(r) - 1 and sin(a), whose remainders are below rounding
# at ln(2)/2 and at a quarter turn.
_EXPM1: Final = [1.0 / math.factorial(n) for n in range(1, 14)]
_SINE: Final = [(-1.0) ** (n // 2) / math.factorial(n) for n in range(3, 20, 2)]
# tanh(z)/z = _OVER(z^2)/_UNDER(z^2), to 6e-18 at z up to ln(2)/4: exact at 0 and at the zeros of a
# Chebyshev polynomial.
_OVER: Final = [1.0, 0.11109937080188846, 0.001057418935065961]
_UNDER: Final = [1.0, 0.444432704135216, 0.015868320315341737]
_TURN: Final = 1.0 / (2.0 * math.pi)
# ln(2), and what that double leaves out.
_LN2, _LN2_REST = math.log(2.0), 2.3190468138462996e-17


def _series(x: LaneNumbers, coefficients: list[float]) -> LaneNumbers:
    """c[0] + c[1] x + ..., each product added without rounding it."""
    value: LaneNumbers | float = coefficients[-1]
    for c in reversed(coefficients[:-1]):
        value = x.call('fma', value, c)
    assert isinstance(value, LaneNumbers)
    return value


def _within(x: LaneNumbers, least: float, most: float) -> LaneNumbers:
    x = (x < least).choose(least, x)
    return (x > most).choose(most, x)


def _parted(x: LaneNumbers, unit: float, rest: float) -> tuple[LaneNumbers, LaneNumbers]:
    """2^k and r of x = k (unit + rest) + r, r at most half of the unit in size."""
    whole = x.call('fma', 1.0 / unit, WHOLE)
    k = WHOLE - whole
    return whole.power_of_two(), k.call('fma', rest, k.call('fma', unit, x))


def _exp(x: LaneNumbers) -> LaneNumbers:
    power, r = _parted(_within(x, -708.0, 709.0), _LN2, _LN2_REST)
    return (r * _series(r, _EXPM1)).call('fma', power, power)


def _tanh(x: LaneNumbers) -> LaneNumbers:
    """(e^2x - 1)/(e^2x + 1) with e^2z = (under + z over)/(under - z over): one division."""
    power, z = _parted(_within(x, -20.0, 20.0), 0.5 * _LN2, 0.5 * _LN2_REST)
    over, under = z * _series(z * z, _OVER), _series(z * z, _UNDER)
    more, less = power + 1.0, power - 1.0
    return less.call('fma', under, more * over) / more.call('fma', under, less * over)


def _sine(turns: LaneNumbers) -> LaneNumbers:
    """sin(2 pi turns): Taylor series up to a quarter turn, to rounding."""
    part = turns - (turns + 0.5).call('floor')
    rest = (part > 0.0).choose(0.5, -0.5) - part
    a = 2.0 * math.pi * (abs(part) <= 0.25).choose(part, rest)
    z = a * a
    return a + a * z * _series(z, _SINE)


def _sign(x: LaneNumbers) -> LaneNumbers:
    return (x > 0.0).choose(1.0, 0.0) - (x < 0.0).choose(1.0, 0.0)


# Result from operands a, b and c.
PURE: Final[dict[int, Callable[[LaneNumbers, LaneNumbers, LaneNumbers], LaneNumbers]]] = {
    m.COPY: lambda a, _b, _c: a,
    m.ADD: lambda a, b, _: a + b,
    m.SUB: lambda a, b, _: a - b,
    m.MUL: lambda a, b, _: a * b,
    m.DIV: lambda a, b, _: a / b,
    m.NEG: lambda a, _b, _c: -a,
    m.ABS: lambda a, _b, _c: abs(a),
    m.SIGN: lambda a, _b, _c: _sign(a),
    m.SQRT: lambda a, _b, _c: a.call('sqrt'),
    m.EXP: lambda a, _b, _c: _exp(a),
    m.LOG: lambda a, _b, _c: a.call('log'),
    m.SIN: lambda a, _b, _c: _sine(a * _TURN),
    m.COS: lambda a, _b, _c: _sine(a * _TURN + 0.25),
    m.TANH: lambda a, _b, _c: _tanh(a),
    m.ATAN: lambda a, _b, _c: a.call('atan'),
    m.POW: lambda a, b, _: a.call('pow', b),
    m.MIN: lambda a, b, _: ((a < b) | a.differs(a)).choose(a, b),
    m.MAX: lambda a, b, _: ((a > b) | a.differs(a)).choose(a, b),
    m.LESS: lambda a, b, _: (a < b).choose(1.0, 0.0),
    m.SELECT: lambda a, b, c: c.differs(0.0).choose(a, b),
    m.RECALL: lambda a, b, _: a.differs(a).choose(b, a),  # b where nothing is remembered yet
}


def _lag(a: LaneNumbers, b: LaneNumbers, c: LaneNumbers, kept: LaneNumbers) -> Remembered:
    """Of a value held over the step: mean, and what it ends with."""
    end = a + (kept - a) * b
    return a + (kept - a) * c, end, end - kept, b


def _integral(a: LaneNumbers, b: LaneNumbers, _: LaneNumbers, kept: LaneNumbers) -> Remembered:
    return kept + 0.5 * b * a, kept + b * a, b * a, b


def _dragged(kept: LaneNumbers, at: LaneNumbers, half: LaneNumbers) -> LaneNumbers:
    low, high = at - half, at + half
    kept = (low > kept).choose(low, kept)
    return (high < kept).choose(high, kept)


def _play(a: LaneNumbers, b: LaneNumbers, c: LaneNumbers, kept: LaneNumbers) -> Remembered:
    """Of a line of mean a that rises by c: it drags from its end backwards, if it does."""
    last = a + 0.5 * c
    begin = _dragged(kept, a - 0.5 * c, b)
    end = _dragged(begin, last, b)
    moved, way = end - begin, abs(c)
    touches = (abs(last - end) >= b * (1.0 - 1e-9)).choose(1.0, 0.0)
    share = (abs(moved) < way).choose(abs(moved) / way, (way > 0.0).choose(1.0, touches))
    return begin + 0.5 * moved * share, end, moved, share


def _limit(a: LaneNumbers, b: LaneNumbers, c: LaneNumbers, kept: LaneNumbers) -> Remembered:
    """Of a line of mean a that rises by c, by at most b: as fast as it may until it is caught.

    The mean is that of the line less the two triangles by which it is missed.
    """
    last, gap = a + 0.5 * c, a - 0.5 * c - kept
    closing = b - (gap < 0.0).choose(-c, c)
    caught, slow = abs(gap) < closing, abs(c) <= b
    before = caught.choose(abs(gap) / closing, 1.0)
    after = 1.0 - before
    left = slow.choose(last, last - after * (c - b.call('copysign', c)))
    end = caught.choose(left, kept + b.call('copysign', gap))
    missed = before * gap + caught.choose(after, 1.0) * (last - end)
    share = slow.choose(caught.choose(after, 0.0), 0.0)
    return a - 0.5 * missed, end, end - kept, share


# Result, what is remembered, by how much the result changes over the step without leaps, and (of
# play and limit) the last share of the step, in which it follows; from operands and the memory.
REMEMBERING: Final[
    dict[int, Callable[[LaneNumbers, LaneNumbers, LaneNumbers, LaneNumbers], Remembered]]
] = {m.LAG: _lag, m.INTEGRAL: _integral, m.PLAY: _play, m.LIMIT: _limit}


def remembered(operation: int, a: LaneNumbers, kept: LaneNumbers) -> LaneNumbers:
    """What an operation remembers that has not been executed yet, which is no number."""
    return kept.differs(kept).choose(0.0 if operation == m.INTEGRAL else a, kept)
