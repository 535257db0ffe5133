"""For the page: what explains the samples, how sure that is, and the parameters if it is true."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from actuator_glue.online.stream import structure_effects, structure_weights
from actuator_glue.report import experiments
from actuator_glue.report.quantity import said_in


@dataclass(frozen=True, slots=True)
class Explanation:
    """A structure that an estimator carries.

    Attributes:
        name: its effects, or "Eq. (2)".
        weight: its probability among those carried.
        parameters: of each its size if the structure is true, as `said`.
    """

    name: str
    weight: float
    parameters: tuple[dict[str, Any], ...] = ()

    def told(self) -> dict[str, Any]:
        """Return the JSON object."""
        return {
            'name': self.name,
            'weight': number(self.weight),
            'parameters': list(self.parameters),
        }


def number(value: Any) -> float | None:
    """Return what JSON can hold."""
    return float(value) if value is not None and math.isfinite(value) else None


def said(name: str, unit: str, mean: float, sd: float) -> dict[str, Any]:
    """Return a parameter with mean and standard deviation [SI] in the unit that people say."""
    factor, shown = said_in(unit, mean)
    return {
        'name': name,
        'unit': shown,
        'mean': number(factor * float(mean)),
        'sd': number(factor * float(sd)),
    }


def explanations(posterior: Any) -> list[Explanation]:
    """Return the structures of a PosteriorMoments, the likeliest first.

    Older messages hold one structure only, and no parameters of each structure by itself.

    Raises:
        InputError: not as many weights as structures.
    """
    weights = structure_weights(posterior)
    sizes = list(getattr(posterior, 'structure_sizes', ())) or [0] * len(weights)
    columns = [
        said(*one)
        for one in zip(
            getattr(posterior, 'structure_parameter_names', ()),
            getattr(posterior, 'structure_units', ()),
            getattr(posterior, 'structure_mean', ()),
            getattr(posterior, 'structure_stddev', ()),
            strict=False,
        )
    ]
    found, start = [], 0
    for (name, weight), size in zip(weights, sizes, strict=False):
        own = tuple(columns[start : start + int(size)])
        found.append(Explanation(name, weight, own))
        start += int(size)
    return sorted(found, key=lambda one: -one.weight)


def diagnosed(message: Any) -> dict[str, Any]:
    """Return what a Diagnosis says: names with probabilities, sizes if true, next experiments."""
    whole = _json(message)
    return {
        'verdict': message.verdict,
        'summary': message.summary,
        'reason': getattr(message, 'reason', ''),
        'effects': [_effect(one, whole) for one in message.effects],
        'experiments': experiments.told(whole),
        'advice': list(message.advice),
    }


def _effect(effect: Any, whole: Mapping[str, Any]) -> dict[str, Any]:
    """Return a name that a diagnosis tells, and those that are tied with it."""
    told: dict[str, Any] = {}
    for one in _list(whole, 'effects'):
        if one.get('name') == effect.name:
            told = one
    odds = {r.get('name'): r.get('probability') for r in _list(told, 'rivals')}
    return {
        'name': effect.name,
        'probability': number(getattr(effect, 'probability', None)),
        'sizes': _sizes(told),
        'tied': [
            {
                'name': name,
                'probability': number(odds.get(name)),
                'sizes': _if_true(name, effect.name, whole),
            }
            for name in getattr(effect, 'alternatives', ())
        ],
    }


def _if_true(rival: str, told: str, whole: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the sizes that an effect has in place of the reported one."""
    chosen = [name for name in _list(whole, 'structure') if name != told]
    wanted = {*chosen, *structure_effects(rival)}
    row: dict[str, Any] = {}
    for one in _list(whole, 'structures'):
        if set(one.get('effects', ())) == wanted:
            row = one
    known = {
        *_mapping(whole, 'base'),
        *(name for e in _list(whole, 'effects') if e['name'] != told for name in e['parameters']),
    }
    return [
        said(name, unit, size, math.nan)
        for name, unit in _mapping(row, 'units').items()
        if name not in known
        and (size := number(_mapping(row, 'parameters').get(name))) is not None
    ]


def _sizes(told: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the parameters of an effect that the records fix, with their 95 % limits."""
    out = []
    for name, size in _mapping(told, 'parameters').items():
        if size.get('identified', True) and number(size.get('mean')) is not None:
            factor, unit = said_in(size['unit'], size['mean'])
            limits = [number(factor * (size[limit] or 0.0)) for limit in ('lower', 'upper')]
            mean = number(factor * size['mean'])
            out.append({'name': name, 'unit': unit, 'mean': mean, 'sd': None, 'limits': limits})
    return out


def _json(message: Any) -> Mapping[str, Any]:
    """Return the whole diagnosis; nothing where it cannot be read."""
    try:
        found = json.loads(getattr(message, 'json', '') or '{}')
    except ValueError:
        return {}
    return found if isinstance(found, dict) else {}


def _list(of: Mapping[str, Any], key: str) -> list[Any]:
    found = of.get(key)
    return found if isinstance(found, list) else []


def _mapping(of: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    found = of.get(key)
    return found if isinstance(found, dict) else {}
