"""Settings of the online estimator: window, sampler, bands."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, Literal, TypeAlias, get_args

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.inference.bands import check_levels
from actuator_glue.inference.carried import Drift

Likelihood: TypeAlias = Literal['glue', 'gaussian']
PriorMode: TypeAlias = Literal['box', 'calibration', 'sequential']
Contradiction: TypeAlias = Literal['widen', 'restart', 'alarm']
# Value of `shaping_factor` for which each window computes G from its own residual.
AUTOMATIC = 0.0

CHOICES: dict[str, tuple[str, ...]] = {
    'likelihood': get_args(Likelihood),
    'prior': get_args(PriorMode),
    'contradiction': get_args(Contradiction),
}


@dataclass(frozen=True, slots=True)
class Limit:
    """Range of one numeric setting.

    Attributes:
        unit: SI unit, '1' where there is none.
        lower: smallest value allowed.
        upper: largest value allowed.
        meaning: one line for people.
    """

    unit: str
    lower: float
    upper: float
    meaning: str


# One table: the node declares its parameters from it and every entry point checks against it.
LIMITS: dict[str, Limit] = {
    'window': Limit('s', 0.05, 600.0, 'length of a window'),
    'hop': Limit('s', 0.01, 600.0, 'time from one window to the next'),
    'settle': Limit('s', 0.0, 60.0, 'start of a window that only lets the state be forgotten'),
    'time_budget': Limit('s', 1e-3, 600.0, 'longest time one window may be computed'),
    'shaping_factor': Limit(
        '1', 0.0, 1e9, 'G of L = -G ln Var[E], Eq. (4); 0: half of what the residual is worth'
    ),
    'evaluations': Limit('1', 2000, 10_000_000, 'evaluations of a window of Eq. (2), at most'),
    'start_evaluations': Limit('1', 2000, 10_000_000, 'evaluations of a window sampled afresh'),
    'chains': Limit('1', 3, 256, 'Markov chains'),
    'draws': Limit('1', 20, 5000, 'posterior draws simulated for a band'),
    'seed': Limit('1', 0, 2**53, 'seed of the sampler'),
    'ess': Limit('1', 50, 1_000_000, 'effective sample size at which a window may end sooner'),
    'rhat_limit': Limit('1', 1.0, 2.0, 'largest R-hat that counts as converged'),
    'frequency_max': Limit('Hz', 0.1, 1000.0, 'upper end of the frequency-response band'),
    'frequencies': Limit('1', 2, 2000, 'frequencies of the frequency-response band'),
    'headline_frequency': Limit('Hz', 0.01, 1000.0, 'frequency of the scalars for plotting'),
    'drift': Limit('h^-1/2', 0.0, 100.0, 'standard deviation of ln parameter after an hour'),
    'prior_age': Limit('s', 0.0, 3.2e9, 'time from the calibration to the start of the stream'),
    'false_alarms': Limit('1/h', 1e-6, 1e3, 'false alarms of the check of the prior, at most'),
    'clock_tolerance': Limit('s', 1e-4, 60.0, 'step of the stamps that counts as a clock jump'),
}


@dataclass(frozen=True, slots=True)
class EstimatorSettings:
    """Settings of the online estimator; times in seconds, whatever the sample rate.

    `LIMITS` gives unit, range and meaning of each number.

    Attributes:
        likelihood: 'glue' is Eq. (4); 'gaussian' is a formal one.
        levels: probability of each band, ascending, in (0, 1).
        prior: 'box' begins every window from the box; 'calibration' from a calibration;
            'sequential' from all earlier samples that the window does not hold.
        drift_of: rates of single parameters in place of `drift`, NAME=RATE each.
        contradiction: what follows when data contradict the prior: 'widen' it, 'restart' from
            the box, or 'alarm' only.

    Raises:
        InputError: a setting outside its range, or settings that contradict each other.
    """

    window: float = 5.0
    hop: float = 1.0
    settle: float = 0.5
    time_budget: float = 0.8
    shaping_factor: float = AUTOMATIC
    evaluations: int = 4000
    start_evaluations: int = 30_000
    chains: int = 8
    draws: int = 200
    seed: int = 1
    ess: int = 400
    rhat_limit: float = 1.05
    frequency_max: float = 10.0
    frequencies: int = 50
    headline_frequency: float = 5.0
    clock_tolerance: float = 0.1
    likelihood: Likelihood = 'glue'
    levels: tuple[float, ...] = (0.5, 0.95)
    prior: PriorMode = 'box'
    drift: float = 0.02
    drift_of: tuple[str, ...] = ()
    prior_age: float = 0.0
    contradiction: Contradiction = 'widen'
    false_alarms: float = 0.1

    def __post_init__(self) -> None:
        for name, limit in LIMITS.items():
            value = getattr(self, name)
            if not (np.isfinite(value) and limit.lower <= value <= limit.upper):
                raise InputError(
                    f'{name} = {value:g} is outside [{limit.lower:g}, {limit.upper:g}] '
                    f'{limit.unit} ({limit.meaning})'
                )
        object.__setattr__(self, 'levels', tuple(check_levels(self.levels).tolist()))
        if list(self.levels) != sorted(set(self.levels)):
            raise InputError(f'levels {self.levels} must ascend')
        for name, known in CHOICES.items():
            if getattr(self, name) not in known:
                raise InputError(
                    f'{name} {getattr(self, name)!r} is unknown; use one of {", ".join(known)}'
                )
        object.__setattr__(self, 'drift_of', tuple(str(word) for word in self.drift_of if word))
        self.drifts()
        if self.hop > self.window:
            raise InputError(f'hop {self.hop:g} s is longer than the window {self.window:g} s')
        if self.settle > 0.8 * self.window:
            raise InputError(
                f'settle {self.settle:g} s leaves less than a fifth of the window '
                f'{self.window:g} s to be fitted; shorten it'
            )
        if self.time_budget > self.hop:
            raise InputError(
                f'time_budget {self.time_budget:g} s is longer than the hop {self.hop:g} s: '
                'windows would pile up'
            )

    def drifts(self) -> Drift:
        """Return the drift rates of the parameters.

        Raises:
            InputError: a word of `drift_of` that is not NAME=RATE.
        """
        own = {}
        for word in self.drift_of:
            name, _, rate = word.partition('=')
            try:
                own[name.strip()] = float(rate)
            except ValueError:
                raise InputError(f'drift_of {word!r} is not NAME=RATE') from None
        return Drift.of(self.drift, own)

    @staticmethod
    def from_mapping(values: Mapping[str, Any], source: str = '') -> EstimatorSettings:
        """Return settings from names and values; what is not named keeps its default.

        Raises:
            InputError: unknown names, values of the wrong kind or outside their range.
        """
        where = f'{source}: ' if source else ''
        kinds = {f.name: f.type for f in fields(EstimatorSettings)}
        unknown = sorted(set(values) - set(kinds))
        if unknown:
            raise InputError(f'{where}unknown estimator settings {unknown}')
        clean: dict[str, Any] = {}
        for name, value in values.items():
            try:
                if name == 'levels':
                    clean[name] = tuple(float(v) for v in value)
                elif name == 'drift_of':
                    clean[name] = tuple(str(v) for v in value)
                elif kinds[name] == 'int':
                    clean[name] = int(value)
                elif kinds[name] == 'float':
                    clean[name] = float(value)
                else:
                    clean[name] = value
            except (TypeError, ValueError) as error:
                raise InputError(f'{where}setting {name} = {value!r} ({error})') from error
        try:
            return EstimatorSettings(**clean)
        except InputError as error:
            raise InputError(f'{where}{error}') from error

    @staticmethod
    def from_json(text: str, source: str = '') -> EstimatorSettings:
        """Return settings from the JSON object of an EstimatorSetup.

        Raises:
            InputError: no JSON object, or as `from_mapping`.
        """
        try:
            values = json.loads(text)
        except ValueError as error:
            raise InputError(f'{source}: estimator settings are no JSON ({error})') from error
        if not isinstance(values, dict):
            raise InputError(f'{source}: estimator settings are no JSON object')
        # Keys that belong to the model and the prior.
        for name in ('start', 'definitions', 'carried', 'structures'):
            values.pop(name, None)
        return EstimatorSettings.from_mapping(values, source)
