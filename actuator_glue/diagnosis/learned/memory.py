"""Forms of learned terms that remember, or change with time.

Hysteresis is the play operator in a share of the signal (any hysteresis, after Prandtl and
Ishlinskii, is a sum of these), or in all of it, which is lost motion and needs one size only.
Memory is offered only where the signal goes on through the loop; that of a sensor or a specimen
has names in the catalogue: backlash, yielding, friction. A changing gain begins to change at the
start of the test and settles; until then it drifts. It is offered at the sensor, not the command:
a slow change of either leaves the same.
A pair of poles and zeros is written at the command: in a linear loop a transducer's or a frame's
resonance has the same effect.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Final

import numpy as np

from actuator_glue.diagnosis.learned.sizes import LEARNED
from actuator_glue.model.effects import Effect
from actuator_glue.model.effects.terms.entry import starting_from, term
from actuator_glue.model.effects.terms.expression import SIGNAL
from actuator_glue.model.parameters import Parameter

# Place, the quantity that lags at reversals there (play), and the sign of the lag in the signal.
_LATE: Final = {
    'command': ('command', 'u', '-'),
    'feedback': ('valve', 'x', '+'),
    'valve': ('valve', 'e', '-'),
    'flow': ('flow', 'q', '-'),
}
_LOST: Final = ('command', 'feedback')
# Name of each where all of the quantity has play: that of the valve is in the catalogue.
_ALL_LATE: Final = {
    **{word: f'learned-{word}-play' for word in _LOST},
    'valve': 'valve-hysteresis',
}
# Places whose gain may change, and the quantity of which a share is added to the signal.
_SETTLING: Final = (('flow', 'q'), ('specimen', 'k*x'), ('sensor', 'y'))
_SHARE = (-1.0, 2.0)  # at -1 nothing is left
_WIDTHS = (1e-3, 0.5)  # of the signal's size
# Limits of a resonance: over the frequency at which a sine of the test's stroke has its speed, and
# over the sample rate. With twice the upper limit a real machine got a damped resonance far above
# its sweep, which was worse in other tests.
_FREQUENCIES, _SAMPLED = (0.1, 4.0), 0.4
_DAMPINGS = (0.005, 0.7)
# Frequencies, dampings and sizes from which fits start: a resonance's response is narrow.
_LOOKED, _DAMPED, _SEEN = 10, (0.05, 0.2), 0.02
_HEIGHT = 2.0  # largest change of the gain at a resonance, and above it
_TIMES = (0.02, 5.0)  # of the test's duration: with the longest, a drift is linear but for 9 %


def forms(sizes: Mapping[str, float]) -> list[Effect]:
    """Return the forms for a test of these sizes (sizes.sizes_of)."""
    return [
        *(_play(word, sizes) for word in _LOST),
        *(_hysteresis(word, sizes) for word in _LATE),
        _resonance(sizes),
        *(
            _settling(place, of, sizes['t'])
            for place, of in _SETTLING
            if place != 'specimen' or sizes['k'] > 0.0
        ),
    ]


def _play(word: str, sizes: Mapping[str, float]) -> Effect:
    """Return lost motion: half the width between reversals."""
    place, of, sign = _LATE[word]
    signal, name = SIGNAL[place], f'{word}_play'
    return term(
        f'learned-{word}-play',
        f'{place}: {signal} = {signal} {sign} ({of} - play({of}, {name}))',
        (Parameter(name, 'm', 0.0, _WIDTHS[1] * sizes[of], 'half width of the play', 0.0),),
        source=LEARNED,
    )


def _hysteresis(word: str, sizes: Mapping[str, float]) -> Effect:
    """Return play in a share of the quantity."""
    place, of, sign = _LATE[word]
    signal, name = SIGNAL[place], f'{word}_hysteresis'
    low, high = (share * sizes[of] for share in _WIDTHS)
    unit = 'N/s' if of == 'q' else 'm'
    effect = term(
        f'learned-{word}-hysteresis',
        f'{place}: {signal} = {signal} {sign} {name}*({of} - play({of}, {name}_width))',
        (
            Parameter(name, '1', *_SHARE, f'share of {of} that turns over late', 0.0),
            Parameter(f'{name}_width', unit, low, high, 'half width of the play', 10.0 * low),
        ),
        source=LEARNED,
    )
    late = _ALL_LATE.get(word)
    return effect if late is None else replace(effect, holds=(late, name, 1.0))


def _settling(place: str, of: str, duration: float) -> Effect:
    """Return a gain that finally changes by a share, with a time constant."""
    signal, name = SIGNAL[place], f'{place}_settling'
    shortest, longest = (share * duration for share in _TIMES)
    return term(
        f'learned-{place}-settling',
        f'{place}: {signal} = {signal} + {name}*{of}*(1 - exp(-t/{name}_time))',
        (
            Parameter(name, '1', *_SHARE, f'share that {of} changes by in the end', 0.0),
            Parameter(f'{name}_time', 's', shortest, longest, 'time constant', duration),
        ),
        source=LEARNED,
    )


def _resonance(sizes: Mapping[str, float]) -> Effect:
    """Return a pair of poles that changes the gain at their frequency and above it."""
    usual = sizes['v'] / (2.0 * math.pi * sizes['u'])
    low, high = (share * usual for share in _FREQUENCIES)
    high = max(2.0 * low, min(high, _SAMPLED / sizes['h']))
    poles = 'resonance_hz, resonance_damping'
    starts = (
        (*sizes_of_it, hertz, damping)
        for hertz in np.geomspace(low, high, _LOOKED).tolist()
        for damping in _DAMPED
        for sizes_of_it in ((_SEEN, 0.0), (-_SEEN, 0.0), (0.0, _SEEN), (0.0, -_SEEN))
    )
    poles_at = term(
        'learned-command-resonance',
        f'command: u = u + resonance*bandpass(u, {poles}) + beyond*(u - lowpass(u, {poles}))',
        (
            Parameter('resonance', '1', -_HEIGHT, _HEIGHT, 'change of the gain at it', 0.0),
            Parameter('beyond', '1', -_HEIGHT, _HEIGHT, 'change of the gain above it', 0.0),
            Parameter('resonance_hz', 'Hz', low, high, 'frequency', math.sqrt(low * high)),
            Parameter('resonance_damping', '1', *_DAMPINGS, 'share of critical damping', 0.1),
        ),
        source=LEARNED,
    )
    return starting_from(poles_at, starts)
