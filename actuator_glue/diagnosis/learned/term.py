"""A learned term as people and files have it: equation, numbers, intervals, range of validity."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from actuator_glue.diagnosis.estimate import Estimate
from actuator_glue.diagnosis.learned.sizes import DIMENSIONS, LEARNED, unit_text
from actuator_glue.diagnosis.trial import Trial
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.json_value import Json
from actuator_glue.model.effects import Effect
from actuator_glue.model.effects.terms.definition import entries, mapping
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array

_UNITS = {symbol: unit_text(powers) for symbol, powers in DIMENSIONS.items()}


@dataclass(frozen=True, slots=True)
class LearnedTerm:
    """A description of what the catalogue has no name for.

    Attributes:
        name: name of the effect.
        place: where in the loop it acts.
        equation: what it does to the signal there.
        numbers: the equation with the best parameters, whose error is told.
        best: these parameters [unit].
        parameters: posterior of its parameters.
        excited: range of everything in the equation that moved, about [unit of the symbol].
        definition: the effect as files of effects have it.
    """

    name: str
    place: str
    equation: str
    numbers: str
    best: dict[str, float]
    parameters: dict[str, Estimate]
    excited: dict[str, tuple[float, float]]
    definition: Json

    @property
    def effect(self) -> Effect:
        """The effect, which the catalogue does not contain."""
        return entries({self.name: self.definition})[0]

    def sentence(self) -> str:
        """Return equation, intervals and range in one sentence."""
        sizes = ', '.join(
            f'{n} = {self.best[n]:.4g}{"" if p.unit == "1" else f" {p.unit}"}'
            f' (95 % {p.lower:.4g} to {p.upper:.4g})'
            for n, p in self.parameters.items()
        )
        ranges = ', '.join(
            f'{s} from {low:.3g} to {high:.3g} {_UNITS[s]}'
            for s, (low, high) in self.excited.items()
        )
        return (
            f'{self.name} was learned from these records, at the {self.place}: {self.equation} '
            f'with {sizes}; a description, not valid beyond {ranges}'
        )

    def to_json(self) -> Json:
        """Return the JSON object of the term."""
        return {
            'name': self.name,
            'place': self.place,
            'equation': self.equation,
            'expression': self.numbers,
            'best': dict(self.best),
            'parameters': {name: p.to_json() for name, p in self.parameters.items()},
            'excited': {
                s: {'lower': low, 'upper': high, 'unit': _UNITS[s]}
                for s, (low, high) in self.excited.items()
            },
        }


def is_learned(effect: Effect) -> bool:
    """Whether an effect is a term that a diagnosis learned, now or before."""
    return effect.source == LEARNED


def any_learned(structure: Structure) -> bool:
    """Whether a structure has a learned term."""
    return any(map(is_learned, structure.entries))


def described(
    trial: Trial, data: Data, estimates: Mapping[str, Estimate]
) -> tuple[LearnedTerm, ...]:
    """Return the learned terms of a structure."""
    out, theta = [], dict(zip(trial.structure.names, map(float, trial.fit.theta), strict=True))
    for effect in trial.structure.entries:
        if is_learned(effect):
            own = {p.name: estimates[p.name] for p in effect.parameters}
            best = {n: theta[n] for n in own}
            words = set(re.findall(r'[a-z_0-9]+', effect.equation))
            excited = {
                s: (float(z.min()), float(z.max()))
                for s, z in _motion(trial, data).items()
                if s in words
            }
            out.append(
                LearnedTerm(
                    effect.name, effect.place, effect.equation, _numbers(effect.equation, best),
                    best, own, excited, mapping([effect])[effect.name],
                )
            )  # fmt: skip
    return tuple(out)


def _numbers(equation: str, best: Mapping[str, float]) -> str:
    for name, value in best.items():
        equation = re.sub(rf'\b{name}\b', f'{value:.4g}', equation)
    return equation.replace('+ -', '- ')


def _motion(trial: Trial, data: Data) -> dict[str, Array]:
    """Return the signals of the fitting records, about: valve and oil quasi-static [SI]."""
    parts = []
    beta_1, into = trial.fit.theta[0], trial.fit.theta[1]
    outputs = data.split(data.target - trial.fit.error)
    for record, mask, x, period, time, origin in zip(
        data.records, data.masks, outputs, data.periods, data.times, data.origins, strict=True
    ):
        u = record.command[mask]
        v, e = np.gradient(x, period), u - x
        row = {'u': u, 'e': e, 'x': x, 'y': x, 'v': v, 'q': into / beta_1 * e}
        parts.append({**row, 'f': record.known_stiffness() * x, 't': origin + time})
    return {s: np.concatenate([p[s] for p in parts]) for s in parts[0]}
