"""How to calibrate: the options of `calibrate`, each with the default of the command line."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import timedelta
from pathlib import Path
from typing import Any, Literal, TypedDict

from actuator_glue.api.calibration_result import Calibration
from actuator_glue.api.given import seed_given
from actuator_glue.api.prior import DRIFT, check_prior
from actuator_glue.errors import InputError
from actuator_glue.given import names, number, of_kind, one_of, take_numbers


@dataclass(frozen=True, slots=True)
class CalibrationOptions:
    """How to calibrate; every one has the default of the command line.

    Attributes:
        effects: effects of the catalogue beyond Eq. (2), by name.
        bounds: prior bounds by parameter [its unit] in place of those of Table 3 or the catalogue.
        likelihood: 'glue' is Eq. (4); 'gaussian' and 'ar1' are formal ones.
        shaping_factor: G of L = -G ln Var[E], Eq. (4), used with 'glue' only; 'auto' is half of
            the independent samples that the residual is worth (`effective_size`).
        evaluations: likelihood evaluations; with effects as many again where their best fit shows
            that the residual is worth another number of samples.
        seed: seed of the sampler; None for a fresh one, which the result says.
        sampler: 'adaptive' is DREAM(ZS) with an adaptive independence move and an annealed start;
            'published' is DREAM(ZS) as Vrugt (2016) runs it, and needs many times the evaluations.
        initial: state at the first sample, 'rest', 'measured', or 'auto' to look.
        settle: start of each record that only lets the initial state be forgotten [s]; None for
            0 from rest, else 1.
        prior: an earlier calibration of the actuator, or the file it was saved to; None for
            nothing known beside the bounds.
        drift: standard deviation by which the logarithm of each parameter may have moved in an
            hour since (random walk) [h^-1/2].
        prior_age: time since that calibration, a `timedelta` or a number of seconds.
        use_force: the recorded forces are evidence, too; not with 'ar1'.
    """

    effects: tuple[str, ...] = ()
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    likelihood: Literal['glue', 'gaussian', 'ar1'] = 'glue'
    shaping_factor: float | Literal['auto'] = 'auto'
    evaluations: int = 60_000
    seed: int = 1
    sampler: Literal['adaptive', 'published'] = 'adaptive'
    initial: Literal['auto', 'rest', 'measured'] = 'auto'
    settle: float | None = None
    prior: Calibration | Path | str | None = None
    drift: float = DRIFT
    prior_age: timedelta | float = 0.0
    use_force: bool = False

    def __post_init__(self) -> None:
        of_kind(self.bounds, 'bounds', Mapping, 'lower and upper by name, as {"beta_1": (0, 800)}')
        effects = names(self.effects, 'effects')
        bounds = {name: _limits(pair, name) for name, pair in dict(self.bounds).items()}
        for name, value in (
            ('effects', effects),
            ('bounds', bounds),
            ('seed', seed_given(self.seed)),
        ):
            object.__setattr__(self, name, value)
        take_numbers(self)
        if self.use_force and self.likelihood == 'ar1':
            raise InputError(
                "the likelihood 'ar1' is one of the displacement alone and takes no force; use "
                "'glue' or 'gaussian'"
            )
        if isinstance(self.shaping_factor, str) and self.shaping_factor != 'auto':
            raise InputError(f"shaping factor {self.shaping_factor!r} is no number, nor 'auto'")
        if self.shaping_factor != 'auto' and self.likelihood != 'glue':
            raise InputError(
                f"a shaping factor is one of the likelihood 'glue', Eq. (4), and "
                f'{self.likelihood!r} has none; leave one of both out'
            )
        if self.settle is not None and self.settle < 0.0:
            raise InputError(f'settle {self.settle:g} s is negative')
        check_prior(self.prior is not None, self.drift, self.prior_age)
        for name, known in (
            ('likelihood', ('glue', 'gaussian', 'ar1')),
            ('initial', ('auto', 'rest', 'measured')),
            ('sampler', ('adaptive', 'published')),
        ):
            one_of(getattr(self, name), name, known)


class CalibrationChanges(TypedDict, total=False):
    """The options by name, for type checkers; a test holds them to `CalibrationOptions`."""

    effects: tuple[str, ...] | list[str] | str
    bounds: Mapping[str, tuple[float, float]]
    likelihood: Literal['glue', 'gaussian', 'ar1']
    shaping_factor: float | Literal['auto']
    evaluations: int
    seed: int | None
    sampler: Literal['adaptive', 'published']
    initial: Literal['auto', 'rest', 'measured']
    settle: float | None
    prior: Calibration | Path | str | None
    drift: float
    prior_age: timedelta | float
    use_force: bool


def _limits(pair: Any, name: str) -> tuple[float, float]:
    try:
        low, high = pair
    except (TypeError, ValueError):
        raise InputError(f'bounds of {name} are {pair!r}; give a lower and an upper one') from None
    return number(low, f'lower bound of {name}'), number(high, f'upper bound of {name}')
