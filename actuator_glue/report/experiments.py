"""The tests that would tell tied names apart, in words, from the JSON of a diagnosis."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from actuator_glue.report.quantity import plain

_MOST = 3  # that are told, best first


def told(diagnosis: Mapping[str, Any]) -> list[str]:
    """Return the best experiments of a diagnosis in words, the best first.

    Args:
        diagnosis: object of schema `actuator_glue.diagnosis/1`, of whatever version.
    """
    found = diagnosis.get('experiments')
    listed = found if isinstance(found, list) else []
    return [text for one in listed[:_MOST] if (text := _words(one))]


def _words(experiment: Any) -> str:
    try:
        size, stiffness = 1e3 * experiment['amplitude'], 1e-3 * experiment['stiffness']
        where = 'without specimen' if not stiffness else f'with a specimen of {stiffness:.4g} kN/m'
        return (
            f'{experiment["command"]} of {size:.2g} mm {where}, {experiment["seconds"]:.0f} s '
            f'({plain(experiment["expected_nats"], 2)} nats expected between what is tied)'
        )
    except (KeyError, TypeError, ValueError):  # of another version
        return ''
