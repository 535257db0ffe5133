"""Forms of learned terms that remember, or change with time.

Hysteresis is one play operator, of which any (Prandtl-Ishlinskii) is a sum; memory acts only where
the signal goes on through the loop. What a sensor or a specimen remembers has names in the
catalogue: backlash, yielding, friction. A gain that changes begins at the start of the test and
settles; while it does not settle it drifts. Of command and sensor only the sensor is offered: a
slow change of either leaves the same.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from actuator_glue.diagnosis.learned_sizes import LEARNED
from actuator_glue.model.effects import Effect
from actuator_glue.model.effects.terms.entry import term
from actuator_glue.model.effects.terms.expression import SIGNAL
from actuator_glue.model.parameters import Parameter

# Name of the term, place, what turns over late there, and the sign of that in the signal.
_PLAYS: Final = (
    ('command-play', 'command', 'u', '-'),
    ('valve-play', 'valve', 'e', '-'),
    ('feedback-play', 'valve', 'x', '+'),
    ('flow-play', 'flow', 'q', '-'),
)
# Places whose gain may change, and the signal that is changed by a share of something.
_SETTLING: Final = (('flow', 'q'), ('specimen', 'k*x'), ('sensor', 'y'))
# Of one play it is 1; between, a part of the signal passes by.
_SHARE = (-1.0, 2.0)
_WIDTHS = (1e-3, 0.5)  # of the signal's size
_TIMES = (0.02, 5.0)  # of the test's duration: in the longest all but 9 % of a drift are linear


def forms(sizes: Mapping[str, float]) -> list[Effect]:
    """Return the forms for a test of these sizes (learned_sizes.sizes_of)."""
    plays = [_play(*row, sizes) for row in _PLAYS]
    return plays + [
        _settling(place, of, sizes['t'])
        for place, of in _SETTLING
        if place != 'specimen' or sizes['k'] > 0.0
    ]


def _play(word: str, place: str, of: str, sign: str, sizes: Mapping[str, float]) -> Effect:
    """Return play of half the width between reversals, in a share of what moves."""
    signal, name, size = SIGNAL[place], word.replace('-', '_'), sizes[of]
    low, high = (share * size for share in _WIDTHS)
    width = f'{name}_width'
    unit = 'N/s' if of == 'q' else 'm'
    return term(
        f'learned-{word}',
        f'{place}: {signal} = {signal} {sign} {name}_share*({of} - play({of}, {width}))',
        (
            Parameter(f'{name}_share', '1', *_SHARE, f'share of {of} that has play', 0.0),
            Parameter(width, unit, low, high, 'half width of the play', 10.0 * low),
        ),
        source=LEARNED,
    )


def _settling(place: str, of: str, duration: float) -> Effect:
    """Return a gain that changes by a share in the end, and how soon."""
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
