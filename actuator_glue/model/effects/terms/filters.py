"""Linear filters, written with the one that remembers: a lag.

A pair of complex poles is a lag in coordinates that turn: with w the damped angular frequency and
d the decay, the response of impulse response exp(-d t) sin(w t) to x is

    (sin(w t) lag(x cos(w t), 1/d) - cos(w t) lag(x sin(w t), 1/d)) / d,

and that of exp(-d t) cos(w t) likewise. They begin at rest, at the value that x begins with.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final

from actuator_glue.model.effects.terms.tree import Tree

# Time constant of what stays as it began [s]: ten minutes change it by less than a thousandth,
# and what rounding leaves of a change over a sub-step is below 10^-6 of that.
_STAYS: Final = 1e6


def _number(value: float) -> Tree:
    return Tree('number', value=value)


def _sum(a: Tree, b: Tree) -> Tree:
    return Tree('add', (a, b))


def _less(a: Tree, b: Tree) -> Tree:
    return Tree('sub', (a, b))


def _times(a: Tree, b: Tree) -> Tree:
    return Tree('mul', (a, b))


def _over(a: Tree, b: Tree) -> Tree:
    return Tree('div', (a, b))


def rate(x: Tree, time: Tree) -> Tree:
    """Return how fast a value changes, over some time: (x - lag(x, time))/time."""
    return _over(_less(x, Tree('lag', (x, time))), time)


def lowpass(x: Tree, frequency: Tree, damping: Tree) -> Tree:
    """Return w0^2/(s^2 + 2 damping w0 s + w0^2) of a value, w0 = 2 pi frequency, damping < 1."""
    begin = Tree('lag', (x, _number(_STAYS)))
    sine, _, root = _turned(_less(x, begin), frequency, damping)
    return _sum(begin, _over(sine, _times(damping, root)))


def bandpass(x: Tree, frequency: Tree, damping: Tree) -> Tree:
    """Return 2 damping w0 s/(s^2 + 2 damping w0 s + w0^2) of a value: 1 at the frequency."""
    begin = Tree('lag', (x, _number(_STAYS)))
    sine, cosine, root = _turned(_less(x, begin), frequency, damping)
    late = _over(_times(damping, sine), root)
    return _times(_number(2.0), _less(cosine, late))


def _turned(x: Tree, frequency: Tree, damping: Tree) -> tuple[Tree, Tree, Tree]:
    """Return d times the responses of sine and cosine, and sqrt(1 - damping^2).

    Raises:
        ValueError: numbers that no pair of complex poles has.
    """
    if damping.operation == 'number' and not 0.0 < damping.value < 1.0:
        raise ValueError(f'a damping ratio is above 0 and below 1, not {damping.value:g}')
    if frequency.operation == 'number' and not frequency.value > 0.0:
        raise ValueError(f'a frequency is above 0 Hz, not {frequency.value:g}')
    natural = _times(_number(2.0 * math.pi), frequency)
    root = Tree('sqrt', (_less(_number(1.0), _times(damping, damping)),))
    turn = _times(_times(natural, root), Tree('symbol', name='t'))
    memory = _over(_number(1.0), _times(damping, natural))
    sin, cos = Tree('sin', (turn,)), Tree('cos', (turn,))
    of_cos = Tree('lag', (_times(x, cos), memory))
    of_sin = Tree('lag', (_times(x, sin), memory))
    sine = _less(_times(sin, of_cos), _times(cos, of_sin))
    cosine = _sum(_times(cos, of_cos), _times(sin, of_sin))
    return sine, cosine, root


# Functions that remember, and how many arguments they take.
FILTERS: Final[dict[str, tuple[int, Callable[..., Tree]]]] = {
    'rate': (2, rate),
    'lowpass': (3, lowpass),
    'bandpass': (3, bandpass),
}
