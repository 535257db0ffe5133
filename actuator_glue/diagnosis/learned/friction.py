"""Forms of dry friction that builds up gradually, over a velocity or over a displacement."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from actuator_glue.diagnosis.learned.sizes import LARGEST, LEARNED, signal_size
from actuator_glue.model.effects import Effect
from actuator_glue.model.effects.terms.entry import term
from actuator_glue.model.parameters import Parameter

# Catalogue effect of which these are other shapes; falling friction may stand for them, too.
DRY: Final = 'coulomb-friction'
FALLING: Final = 'stribeck-friction'
SHAPES: Final = ('learned-force-friction', 'learned-force-presliding')
# Displacement over which friction builds up, over the stroke.
_WAYS: Final = (1e-4, 0.1)


def forms(sizes: Mapping[str, float]) -> list[Effect]:
    """Return the forms for a test of these sizes (sizes.sizes_of)."""
    places = ('force', 'specimen') if sizes['k'] > 0.0 else ('force',)
    return [form(place, sizes) for place in places for form in (_friction, _presliding)]


def _friction(place: str, sizes: Mapping[str, float]) -> Effect:
    """Return friction that rises over a velocity; at the specimen, that of its supports."""
    name, speed = f'{place}_friction', sizes['v']
    force, size = _dry(place, name, sizes)
    return term(
        f'learned-{place}-friction',
        f'{place}: f = f + {force}*tanh(v/{name}_speed)',
        (
            size,
            Parameter(
                f'{name}_speed', 'm/s', 1e-3 * speed, speed, 'where it is reached', 1e-2 * speed
            ),
        ),
        source=LEARNED,
    )


def _presliding(place: str, sizes: Mapping[str, float]) -> Effect:
    """Return friction that rises over a displacement, as a spring until it slips (Prandtl)."""
    name = f'{place}_presliding'
    force, size = _dry(place, name, sizes)
    low, high = (share * sizes['x'] for share in _WAYS)
    return term(
        f'learned-{place}-presliding',
        f'{place}: f = f + {force}*(x - play(x, {name}_way))/{name}_way',
        (
            size,
            Parameter(f'{name}_way', 'm', low, high, 'where it is reached', 10.0 * low),
        ),
        source=LEARNED,
    )


def _dry(place: str, name: str, sizes: Mapping[str, float]) -> tuple[str, Parameter]:
    """Return friction's size as a force, and the parameter: at the specimen over its stiffness.

    Not negative: it would weaken faster than the oil column is stiff.
    """
    if place == 'specimen':
        return f'k*{name}', Parameter(name, 'm', 0.0, sizes['x'], 'friction as m', 0.0, 'share')
    largest = LARGEST * signal_size(place, sizes)
    return name, Parameter(name, 'N', 0.0, largest, 'friction as N', 0.0, 'share')
