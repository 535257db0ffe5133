"""The explanations of a stream, for /diagnostics: name, how sure, since when, sizes if true."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from actuator_glue.report import experiments
from actuator_glue.report.quantity import plain
from actuator_glue.view.explanations import Explanation, explanations

_NOT_YET = 'not known yet'


class Explained:
    """Explanations of posteriors and diagnoses, as people read them."""

    def __init__(self) -> None:
        self._carried: list[Explanation] = []
        self._since: dict[str, float] = {}
        self._next: str | None = None

    def posterior(self, message: Any) -> None:
        """Take a PosteriorMoments."""
        end = (int(message.index) + int(message.samples)) * float(message.period)
        self._carried = explanations(message)
        names = [one.name for one in self._carried]
        # A stream that began anew is another one.
        before = self._since if all(since <= end for since in self._since.values()) else {}
        self._since = {name: before.get(name, end) for name in names}

    def diagnosis(self, whole: Mapping[str, Any]) -> None:
        """Take the JSON of a diagnosis."""
        tests = experiments.told(whole)
        self._next = tests[0] if tests else 'none: no names are tied'

    def values(self) -> dict[str, str]:
        """Return what is shown on /diagnostics."""
        told = [
            f'{one.name} {100 * one.weight:.0f} % (since {self._since[one.name]:.1f} s)'
            for one in self._carried
        ]
        sizes = [
            f'{one.name}: ' + ', '.join(map(_size, one.parameters))
            for one in self._carried
            if one.parameters
        ]
        return {
            'explanations': ', '.join(told) or _NOT_YET,
            'parameters if true': '; '.join(sizes) or _NOT_YET,
            'next experiment': self._next or _NOT_YET,
        }


def _size(parameter: Mapping[str, Any]) -> str:
    mean, sd = (
        '-' if parameter[key] is None else plain(parameter[key], digits)
        for key, digits in (('mean', 4), ('sd', 2))
    )
    return f'{parameter["name"]} {mean} +- {sd} {parameter["unit"]}'.rstrip()
