"""Forms that a learned term may take: smooth functions of what is known at a place of the loop.

Each is an effect written as an expression (docs/effects.md), its sizes scaled to the test, so that
it is screened, refitted and compared as the effects of the catalogue are.
"""

from __future__ import annotations

from collections.abc import Container
from itertools import groupby
from typing import Final

from actuator_glue.model.effects import Effect, Scale
from actuator_glue.model.effects.terms.entry import term
from actuator_glue.model.effects.terms.expression import PLACES, SIGNAL
from actuator_glue.model.parameters import Parameter

# Terms added to the signal of a place: products of what is known there, '|x|' for a modulus.
# Odd ones keep both directions alike, even ones do not; those with k act with a specimen only.
_PRODUCTS: Final = {
    'command': ('u |u|', 'u u u', 'u u', 'u |v|', '|x| v', 'v |v|', 'v v v'),
    'valve': ('e |e|', 'e e e', 'e e', 'e |x|'),
    'flow': (
        'q x',
        'q x x',
        'q |x|',
        'q |q|',
        'q q q',
        'q f',
        'q f f',
        'f |f|',
        'f f f',
        'f f',
    ),
    'force': ('v |v|', 'v v v', 'v v', '|v|', 'v x x', 'v |x|', 'x |x|', 'x x'),
    'specimen': ('k x |x|', 'k x x', 'k v', 'k v |v|'),
    'sensor': ('y |y|', 'y y y', 'y y', '|y|'),
}
# Places whose signal may be limited.
_SATURATES: Final = ('command', 'valve', 'flow', 'sensor')
_DIMENSIONS: Final = {
    'u': (0, 1, 0),
    'e': (0, 1, 0),
    'x': (0, 1, 0),
    'y': (0, 1, 0),
    'v': (0, 1, -1),
    'q': (1, 0, -1),
    'f': (1, 0, 0),
    'k': (1, -1, 0),
}
LEARNED: Final = 'learned'  # source of such an effect
_LARGEST = 2.0  # of the signal at the test's stroke and speed
_SHARPEST = 5.0  # times a limit may be overdriven
_BENDS = (1e-3, 3.0)  # a bend of a thousandth is a corner


def forms(scale: Scale, known: Container[str] = ()) -> tuple[Effect, ...]:
    """Return the forms for a test of this size.

    Args:
        scale: sizes of the test at the fitted base.
        known: names of effects there are already, which are not offered again.
    """
    sizes = _sizes(scale)
    offered = []
    for place, products in _PRODUCTS.items():
        for product in products:
            factors = product.split()
            if all(sizes[f.strip('|')] > 0.0 for f in factors):
                offered.append(_product(place, factors, sizes))
        if place in _SATURATES:
            offered += [form(place, sizes) for form in (_limited, _one_sided, _fading)]
    if sizes['f'] > 0.0:
        offered.append(_turbulent(sizes))
    offered.append(_rounded_overlap(sizes))
    return tuple(effect for effect in offered if effect.name not in known)


def _sizes(scale: Scale) -> dict[str, float]:
    """Return the size of everything that moves in a test."""
    stroke, speed = scale.stroke, scale.velocity
    error = float(scale.theta[0] / max(scale.theta[1], 1e-9)) * scale.oil * speed
    return {
        'u': stroke,
        'x': stroke,
        'y': stroke,
        'v': speed,
        'e': error,
        'q': scale.oil * speed,
        'f': scale.stiffness * stroke,
        'k': scale.stiffness,
    }


def _signal(place: str, sizes: dict[str, float]) -> float:
    """Return the size that a change of a place's signal is compared with."""
    if place in ('force', 'specimen'):
        # What holds the piston is the oil, with or without a specimen.
        return sizes['q'] / sizes['v'] * sizes['x']
    return sizes[SIGNAL[place]]


def _product(place: str, factors: list[str], sizes: dict[str, float]) -> Effect:
    signal = SIGNAL[PLACES[place]]
    full = 1.0
    unit = list(_DIMENSIONS[signal])
    for factor in factors:
        symbol = factor.strip('|')
        full *= sizes[symbol]
        unit = [a - b for a, b in zip(unit, _DIMENSIONS[symbol], strict=True)]
    powers = [(f, len(list(same))) for f, same in groupby(factors)]
    text = '*'.join(_modulus(f) + (f'**{n}' if n > 1 else '') for f, n in powers)
    name = '-'.join(_word(f) + (str(n) if n > 1 else '') for f, n in powers)
    largest = _LARGEST * _signal(place, sizes) / full
    return _effect(
        place, name, f'{signal} + {{a}}*{text}', unit, (-largest, largest), f'size of {text}'
    )


def _modulus(factor: str) -> str:
    return f'abs({factor.strip("|")})' if '|' in factor else factor


def _word(factor: str) -> str:
    return f'abs{factor.strip("|")}' if '|' in factor else factor


def _limited(place: str, sizes: dict[str, float]) -> Effect:
    """Return a limit with any bend before it: a corner where that is 0, about tanh where it is 2.

    Two hyperbolas about the corners, their slope 1 at the centre.
    """
    z, name = SIGNAL[place], f'{place}_limit'
    above = f'sqrt((1 + {name}*{z})**2 + {name}_bend**2)'
    below = f'sqrt((1 - {name}*{z})**2 + {name}_bend**2)'
    unit = _unit([-d for d in _DIMENSIONS[z]])
    return term(
        f'learned-{place}-limit',
        f'{place}: {z} = 2*{z}*sqrt(1 + {name}_bend**2)/({above} + {below})',
        (
            Parameter(name, unit, 0.0, _SHARPEST / sizes[z], f'one over where {z} bends', 0.0),
            Parameter(f'{name}_bend', '1', *_BENDS, 'width of the bend over where it is', 1.0),
        ),
        source=LEARNED,
    )


def _one_sided(place: str, sizes: dict[str, float]) -> Effect:
    """Return a limit to one side, the lower one where the parameter is negative."""
    z, name = SIGNAL[place], f'{place}_end'
    largest = _SHARPEST / sizes[z]
    unit, meaning = _unit([-d for d in _DIMENSIONS[z]]), f'one over where {z} ends'
    return term(
        f'learned-{place}-end',
        f'{place}: {z} = {z}*(1 + sqrt(1 + {name}_bend**2))'
        f'/(1 + {name}*{z} + sqrt((1 - {name}*{z})**2 + {name}_bend**2))',
        (
            Parameter(name, unit, -largest, largest, meaning, 0.0),
            Parameter(f'{name}_bend', '1', *_BENDS, 'width of the bend over where it is', 1.0),
        ),
        source=LEARNED,
    )


def _fading(place: str, sizes: dict[str, float]) -> Effect:
    """Return a gain that falls from the centre on, which no limit does."""
    z = SIGNAL[place]
    unit, bounds = [-d for d in _DIMENSIONS[z]], (0.0, _SHARPEST / sizes[z])
    meaning = f'one over where {z} is halved'
    return _effect(place, f'fading-{z}', f'{z}/(1 + {{a}}*abs({z}))', unit, bounds, meaning)


def _turbulent(sizes: dict[str, float]) -> Effect:
    """Return a leak as through an orifice, smooth about zero force."""
    largest = _LARGEST * sizes['q'] / sizes['f'] ** 0.5
    name = 'flow_sqrt_f'
    return term(
        'learned-flow-sqrt-f',
        f'flow: q = q + {name}*f/sqrt(abs(f) + {1e-2 * sizes["f"]:.3g})',
        (Parameter(name, 'N^0.5/s', -largest, largest, 'flow over the root of the force', 0.0),),
        source=LEARNED,
    )


def _rounded_overlap(sizes: dict[str, float]) -> Effect:
    """Return a valve that is less steep about its centre, without a corner."""
    width = sizes['e']
    return term(
        'learned-valve-centre',
        'valve: e = e*(1 - valve_centre_depth*exp(-(e/valve_centre_width)**2))',
        (
            Parameter('valve_centre_depth', '1', -1.0, 1.0, 'share of the slope lost', 0.0),
            Parameter('valve_centre_width', 'm', 0.01 * width, width, 'half width', 0.1 * width),
        ),
        source=LEARNED,
    )


def _effect(
    place: str,
    name: str,
    equation: str,
    unit: list[int],
    bounds: tuple[float, float],
    meaning: str,
) -> Effect:
    parameter = f'{place}_{name}'.replace('-', '_')
    left = SIGNAL[PLACES[place]]
    return term(
        f'learned-{place}-{name}',
        f'{place}: {left} = {equation.format(a=parameter)}',
        (Parameter(parameter, _unit(unit), *bounds, meaning, 0.0),),
        source=LEARNED,
    )


def _unit(exponents: list[int]) -> str:
    """Return a unit's text, for example 'N s^2/m^2' or '1/m'."""
    above: list[str] = []
    below: list[str] = []
    for symbol, power in zip(('N', 'm', 's'), exponents, strict=True):
        if power:
            text = symbol + (f'^{abs(power)}' if abs(power) > 1 else '')
            (above if power > 0 else below).append(text)
    bottom = f'({" ".join(below)})' if len(below) > 1 else ''.join(below)
    return (' '.join(above) or '1') + (f'/{bottom}' if bottom else '')
