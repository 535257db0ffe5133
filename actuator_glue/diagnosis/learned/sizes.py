"""Sizes and units of what moves in a test, which forms of learned terms are scaled to."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

from actuator_glue.model.effects import Scale
from actuator_glue.model.effects.terms.expression import SIGNAL

LEARNED: Final = 'learned'  # source of such an effect
LARGEST: Final = 2.0  # of the signal at the test's stroke and speed
DIMENSIONS: Final = {
    'u': (0, 1, 0),
    'e': (0, 1, 0),
    'x': (0, 1, 0),
    'y': (0, 1, 0),
    'v': (0, 1, -1),
    'r': (0, 1, -1),
    'q': (1, 0, -1),
    'f': (1, 0, 0),
    'k': (1, -1, 0),
    't': (0, 0, 1),
}


def sizes_of(scale: Scale) -> dict[str, float]:
    """Return the size of everything that moves in a test, its duration t and period h [s]."""
    stroke, speed = scale.stroke, scale.velocity
    error = float(scale.theta[0] / max(scale.theta[1], 1e-9)) * scale.oil * speed
    return {
        'u': stroke,
        'x': stroke,
        'y': stroke,
        'v': speed,
        'r': speed,
        'e': error,
        'q': scale.oil * speed,
        'f': scale.stiffness * stroke,
        'k': scale.stiffness,
        't': scale.duration,
        'h': scale.period,
    }


def command_rate(sizes: Mapping[str, float]) -> str:
    """Return the rate of the command as an expression [m/s].

    Taken over half a sample: for amplitude and rate at 9 Hz and 128 samples per second, the delay
    left 0 to 2 % of the noise, over a whole sample 1 to 5 %.
    """
    return f'rate(u, {0.5 * sizes["h"]:.3g})'


def signal_size(place: str, sizes: Mapping[str, float]) -> float:
    """Return the size that a change of a place's signal is compared with."""
    if place in ('force', 'specimen'):
        # What holds the piston is the oil, with or without a specimen.
        return sizes['q'] / sizes['v'] * sizes['x']
    return sizes[SIGNAL[place]]


def unit_text(exponents: Sequence[int]) -> str:
    """Return a unit's text, for example 'N s^2/m^2' or '1/m'."""
    above: list[str] = []
    below: list[str] = []
    for symbol, power in zip(('N', 'm', 's'), exponents, strict=True):
        if power:
            text = symbol + (f'^{abs(power)}' if abs(power) > 1 else '')
            (above if power > 0 else below).append(text)
    bottom = f'({" ".join(below)})' if len(below) > 1 else ''.join(below)
    return (' '.join(above) or '1') + (f'/{bottom}' if bottom else '')
