"""Forms that a learned term may take: functions of what is known at a place of the loop.

Smooth forms without memory are written here, friction in friction.py, other forms that remember or
change with time in memory.py.
Each is an effect written as an expression (docs/effects.md), its sizes scaled to the test, so that
it is screened, refitted and compared as the effects of the catalogue are.
"""

from __future__ import annotations

from collections.abc import Container, Iterable, Sequence
from itertools import groupby
from typing import Final

import numpy as np

from actuator_glue.diagnosis.learned import friction as learned_friction
from actuator_glue.diagnosis.learned import memory as learned_memory
from actuator_glue.diagnosis.learned.sizes import (
    DIMENSIONS,
    LARGEST,
    LEARNED,
    command_rate,
    signal_size,
    sizes_of,
    unit_text,
)
from actuator_glue.model.effects import Effect, Scale
from actuator_glue.model.effects.terms.entry import starting_from, term
from actuator_glue.model.effects.terms.expression import PLACES, SIGNAL
from actuator_glue.model.parameters import Coordinate, Parameter

# Terms added to the signal of a place: products of what is known there, '|x|' for a modulus.
# Odd ones keep both directions alike, even ones do not; those with k act with a specimen only.
# At the command the rate is that of the command (r), not of the piston.
_PRODUCTS: Final = {
    'command': ('u |u|', 'u u u', 'u u', 'u |r|', '|u| r', 'r |r|', 'r r r'),
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
_SHARPEST = 5.0  # times a limit may be overdriven
_BENDS = (1e-3, 3.0)  # a bend of a thousandth is a corner
# Steps of a reading, over its size: size tried and largest, width; number of places tried.
_STEPS, _STEP_WIDTH, _PLACES = (0.01, 0.5), 0.005, 20
# What may act in one direction only: damping, a stop or a bracing, a valve in a leak.
_ONE_WAY: Final = {'force': ['v'], 'specimen': ['k', 'x'], 'flow': ['f']}
_WAYS: Final = {'forth': 'max', 'back': 'min'}
# Forms that are another shape of a catalogue effect, and its name.
CAUSES: Final = {
    **dict.fromkeys(learned_friction.SHAPES, learned_friction.DRY),
    'learned-flow-limit': 'flow-saturation',
    'learned-valve-limit': 'flow-saturation',
}


def shape_of(name: str, causes: Container[str]) -> bool:
    """Return whether a learned term is another shape of one of some named causes."""
    dry = CAUSES.get(name) == learned_friction.DRY and learned_friction.FALLING in causes
    return dry or CAUSES.get(name) in causes


def descriptions(names: Iterable[str]) -> int:
    """Return how many of some effects are learned terms and no other shape of a named cause."""
    return sum(n.startswith(f'{LEARNED}-') and n not in CAUSES for n in names)


def forms(scale: Scale, known: Container[str] = ()) -> tuple[Effect, ...]:
    """Return the forms for a test of this size.

    Args:
        scale: sizes of the test at the fitted base.
        known: names of effects there are already, which are not offered again.
    """
    sizes = sizes_of(scale)
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
    offered += [_step(sizes), _rounded_overlap(sizes)]
    offered += [
        _one_way(place, factors, way, sizes)
        for place, factors in _ONE_WAY.items()
        for way in _WAYS
        if all(sizes[f] > 0.0 for f in factors)
    ]
    offered += learned_friction.forms(sizes)
    offered += learned_memory.forms(sizes)
    return tuple(effect for effect in offered if effect.name not in known)


def _product(place: str, factors: list[str], sizes: dict[str, float]) -> Effect:
    powers = [(f, len(list(same))) for f, same in groupby(factors)]
    text = '*'.join(_written(f, sizes) + (f'**{n}' if n > 1 else '') for f, n in powers)
    name = '-'.join(_word(f) + (str(n) if n > 1 else '') for f, n in powers)
    return _added(place, name, text, factors, sizes)


def _one_way(place: str, factors: list[str], way: str, sizes: dict[str, float]) -> Effect:
    """Return a product that acts in one direction only."""
    *others, last = factors
    text = '*'.join([*others, f'{_WAYS[way]}({last}, 0)'])
    return _added(place, '-'.join([*factors, way]), text, factors, sizes)


def _added(
    place: str, name: str, text: str, factors: list[str], sizes: dict[str, float]
) -> Effect:
    """Return a product times a parameter, added to the signal of a place."""
    signal = SIGNAL[PLACES[place]]
    full = 1.0
    unit = list(DIMENSIONS[signal])
    for factor in factors:
        symbol = factor.strip('|')
        full *= sizes[symbol]
        unit = [a - b for a, b in zip(unit, DIMENSIONS[symbol], strict=True)]
    largest = LARGEST * signal_size(place, sizes) / full
    return _effect(
        place, name, f'{signal} + {{a}}*{text}', unit, (-largest, largest), f'size of {text}',
        _coordinate(place, factors),
    )  # fmt: skip


def _coordinate(place: str, factors: Sequence[str]) -> Coordinate | None:
    """Return what a size is sampled as: forces and flows count as shares of the oil's stiffness.

    That holds where the product does not contain the flow, which has this unit already.
    """
    share = place in ('force', 'specimen', 'flow') and 'q' not in ''.join(factors)
    return 'share' if share else None


def _written(factor: str, sizes: dict[str, float]) -> str:
    symbol = factor.strip('|')
    text = command_rate(sizes) if symbol == 'r' else symbol
    return f'abs({text})' if '|' in factor else text


def _word(factor: str) -> str:
    return f'abs{factor.strip("|")}' if '|' in factor else factor


def _limited(place: str, sizes: dict[str, float]) -> Effect:
    """Return a limit with any bend before it: a corner where that is 0, about tanh where it is 2.

    Two hyperbolas about the corners, their slope 1 at the centre.
    """
    z, name = SIGNAL[place], f'{place}_limit'
    above = f'sqrt((1 + {name}*{z})**2 + {name}_bend**2)'
    below = f'sqrt((1 - {name}*{z})**2 + {name}_bend**2)'
    unit = unit_text([-d for d in DIMENSIONS[z]])
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
    unit, meaning = unit_text([-d for d in DIMENSIONS[z]]), f'one over where {z} ends'
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
    """Return a gain that falls from the centre on, unlike that of a limit."""
    z = SIGNAL[place]
    unit, bounds = [-d for d in DIMENSIONS[z]], (0.0, _SHARPEST / sizes[z])
    meaning = f'one over where {z} is halved'
    return _effect(place, f'fading-{z}', f'{z}/(1 + {{a}}*abs({z}))', unit, bounds, meaning)


def _step(sizes: dict[str, float]) -> Effect:
    """Return a reading that jumps where the piston passes a place, as at the joint of a scale.

    The jump has a small fixed width: without one the likelihood would be a staircase.
    """
    size = sizes['y']
    width, most = f'{_STEP_WIDTH * size:.3g}', _STEPS[1] * size
    starts = (
        (sign * _STEPS[0] * size, at * size)
        for at in np.linspace(-1.0, 1.0, 2 * _PLACES + 1)[1::2].tolist()
        for sign in (1.0, -1.0)
    )
    step = term(
        'learned-sensor-step',
        'sensor: y = y + 0.5*sensor_step'
        f'*(tanh((y - sensor_step_at)/{width}) + tanh(sensor_step_at/{width}))',
        (
            Parameter('sensor_step', 'm', -most, most, 'jump of the reading', 0.0),
            Parameter('sensor_step_at', 'm', -size, size, 'where it jumps', 0.0),
        ),
        source=LEARNED,
    )
    return starting_from(step, starts)


def _turbulent(sizes: dict[str, float]) -> Effect:
    """Return a leak as through an orifice, smooth about zero force."""
    largest = LARGEST * sizes['q'] / sizes['f'] ** 0.5
    name = 'flow_sqrt_f'
    return term(
        'learned-flow-sqrt-f',
        f'flow: q = q + {name}*f/sqrt(abs(f) + {1e-2 * sizes["f"]:.3g})',
        (
            Parameter(
                name, 'N^0.5/s', -largest, largest, 'flow over the root of the force', 0.0, 'share'
            ),
        ),
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
    coordinate: Coordinate | None = None,
) -> Effect:
    parameter = f'{place}_{name}'.replace('-', '_')
    left = SIGNAL[PLACES[place]]
    return term(
        f'learned-{place}-{name}',
        f'{place}: {left} = {equation.format(a=parameter)}',
        (Parameter(parameter, unit_text(unit), *bounds, meaning, 0.0, coordinate),),
        source=LEARNED,
    )
