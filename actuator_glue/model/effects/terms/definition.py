"""Effects as plain mappings, which files, messages and saved results hold, and back."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Final

from actuator_glue.errors import InputError
from actuator_glue.model.effects.effect import Effect
from actuator_glue.model.effects.terms.entry import term
from actuator_glue.model.effects.terms.expression import PLACES
from actuator_glue.model.parameters import Parameter

_TEXTS: Final = ('group', 'signature', 'source')
_KEYS: Final = {'unit', 'bounds', 'neutral', 'meaning'}


def entries(content: Any, source: str = '') -> tuple[Effect, ...]:
    """Return the effects of a mapping `name: {place: equation, parameters: {...}}`.

    Args:
        content: for example `{'sensor-cubic': {'sensor': 'y = y + cubic*y**3', 'parameters':
            {'cubic': {'unit': '1/m^2', 'bounds': [-1e4, 1e4], 'neutral': 0}}}}`; a parameter may
            also have a meaning, an effect group, signature, source and searched.
        source: file it comes from, for messages.

    Raises:
        InputError: something is missing, unknown, or cannot be used.
    """
    where = f'{source}: ' if source else ''
    if not isinstance(content, Mapping) or not content:
        raise InputError(f'{where}no effects; `name:` with a place, an equation and `parameters:`')
    try:
        return tuple(_entry(str(name), body) for name, body in content.items())
    except InputError as error:
        raise InputError(f'{where}{error}') from None


def mapping(effects: Iterable[Effect]) -> dict[str, dict[str, Any]]:
    """Return the effects that are written as expressions as `entries` reads them."""
    return {
        e.name: {
            e.place: e.equation,
            'parameters': {
                p.name: {
                    'unit': p.unit,
                    'bounds': [float(p.lower), float(p.upper)],
                    'neutral': float(p.neutral or 0.0),
                    'meaning': p.meaning,
                }
                for p in e.parameters
            },
            'searched': e.searched,
            **{key: getattr(e, key) for key in _TEXTS},
        }
        for e in effects
        if e.expression is not None
    }


def _entry(name: str, body: Any) -> Effect:
    if not isinstance(body, Mapping):
        raise InputError(f'effect {name!r} needs a place with an equation, and parameters')
    places = [key for key in body if key in PLACES]
    unknown = [str(k) for k in body if k not in {*PLACES, *_TEXTS, 'parameters', 'searched'}]
    if unknown:
        raise InputError(
            f'effect {name!r}: {unknown[0]!r} is unknown; known: {", ".join(PLACES)}, '
            f'parameters, {", ".join(_TEXTS)}, searched'
        )
    if len(places) != 1:
        raise InputError(f'effect {name!r} needs one place of {", ".join(PLACES)}')
    parameters = body.get('parameters')
    if not isinstance(parameters, Mapping) or not parameters:
        raise InputError(f'effect {name!r} needs `parameters:`, each with bounds and neutral')
    searched = body.get('searched', True)
    if not isinstance(searched, bool):
        raise InputError(f'effect {name!r}: searched is true or false, not {searched!r}')
    texts = {key: str(body.get(key, '')) for key in _TEXTS}
    return term(
        name,
        f'{places[0]}: {body[places[0]]}',
        tuple(_parameter(f'effect {name!r}', str(p), v) for p, v in parameters.items()),
        group=texts['group'],
        signature=texts['signature'],
        source=texts['source'],
        searched=searched,
    )


def _parameter(where: str, name: str, body: Any) -> Parameter:
    where = f'{where}, parameter {name!r}'
    if not isinstance(body, Mapping) or not {'bounds', 'neutral'} <= set(body):
        raise InputError(f'{where} needs bounds: [lower, upper] and neutral')
    unknown = [str(key) for key in body if key not in _KEYS]
    if unknown:
        raise InputError(f'{where}: {unknown[0]!r} is unknown; known: {", ".join(sorted(_KEYS))}')
    bounds = body['bounds']
    if not isinstance(bounds, list | tuple) or len(bounds) != 2:
        raise InputError(f'{where}: bounds are [lower, upper], not {bounds!r}')
    try:
        lower, upper, neutral = (float(v) for v in (*bounds, body['neutral']))
    except (TypeError, ValueError):
        raise InputError(f'{where}: bounds and neutral are numbers') from None
    unit, meaning = str(body.get('unit', '1')), str(body.get('meaning', ''))
    return Parameter(name, unit, lower, upper, meaning, neutral)
