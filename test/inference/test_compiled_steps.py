"""Compiled steps have the bits of single steps, with the exact kernel where it is needed."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from actuator_glue.errors import InputError
from actuator_glue.inference.choice import choose_model
from actuator_glue.inference.compiled import compiled, log_densities, scratch
from actuator_glue.inference.dream import State, Watchers, init, sample, step, stretch
from actuator_glue.inference.likelihood import GaussianLikelihood, GlueLikelihood
from actuator_glue.inference.moves import PUBLISHED
from actuator_glue.inference.posterior import Problem, _Density
from actuator_glue.inference.settings import SamplerSettings
from actuator_glue.model import reference_problem
from actuator_glue.model.fast import FastErrors
from actuator_glue.model.parameters import bounds
from actuator_glue.records import Array, Record

LOWER, UPPER = bounds()


@cache
def records() -> list[Record]:
    """The beginning of both of problem R."""
    return [record.slice(0, 4000) for record in reference_problem.records()]


def glue() -> GlueLikelihood:
    return GlueLikelihood(FastErrors(records()), 256.0)


def window() -> tuple[_Density, Array, Array]:
    """One record in the coordinates of the online estimator."""
    problem = Problem(
        (records()[1].slice(500, 4000),), choose_model(), initial='measured', settle=0.2
    )
    target = problem.target()
    transform = target.transform
    return _Density(target.log_likelihood, transform), transform.lower, transform.upper


def same(one: State, other: State) -> bool:
    """Whether two states are equal to the last bit."""
    parts = [
        (one.archive.rows, other.archive.rows),
        (one.counts, other.counts),
        (one.sum_log_density, other.sum_log_density),
        *zip(one.now, other.now, strict=True),
        *zip(one.context.tuning, other.context.tuning, strict=True),
    ]
    numbers = [(s.fitted, s.made, s.evaluations, s.power) for s in (one, other)]
    return numbers[0] == numbers[1] and all(np.array_equal(a, b) for a, b in parts)


CASES = {
    'glue': (glue, SamplerSettings()),
    'gaussian': (
        lambda: GaussianLikelihood(FastErrors(records())),
        SamplerSettings(chains=7, thinning=3),
    ),
    'sigma': (
        lambda: GaussianLikelihood(FastErrors(records()), 1e-4),
        SamplerSettings(adaptation=17),
    ),
    # Half of the prior needs the exact kernel.
    'fallback': (glue, SamplerSettings(start='prior', adaptation=100)),
    'window': (window, SamplerSettings(chains=5)),
    'published': (glue, SamplerSettings(chains=3, moves=PUBLISHED)),
}


@pytest.mark.parametrize('case', CASES)
@pytest.mark.parametrize('most', [7, 50])
def test_the_bits_are_those_of_steps(case: str, most: int, rng_seed: int) -> None:
    make, settings = CASES[case]
    made = make()
    density, lower, upper = made if isinstance(made, tuple) else (made, LOWER, UPPER)
    fast = compiled(density)
    assert fast is not None

    def plain(x: Array) -> Array:
        return density(x)

    assert compiled(plain) is None
    # Annealing runs through the same code.
    one = init(np.random.default_rng(rng_seed), density, lower, upper, settings)
    other = init(np.random.default_rng(rng_seed), plain, lower, upper, settings)
    assert same(one, other)
    rngs = np.random.default_rng(rng_seed), np.random.default_rng(rng_seed)
    before = 0 if case == 'window' else density.errors.fallbacks
    while one.made < 250:
        one, path = stretch(rngs[0], one, most)
        while other.made < one.made:
            other, _ = step(rngs[1], other)
        assert same(one, other)
        assert np.array_equal(path.x[-1], one.now.x) or one.made <= settings.adaptation
    assert rngs[0].random() == rngs[1].random()
    if case == 'fallback':
        assert density.errors.fallbacks > before


def test_stretches_from_one_state_do_not_meet(rng_seed: int) -> None:
    density = glue()
    state = init(
        np.random.default_rng(rng_seed), density, LOWER, UPPER, SamplerSettings(thinning=1)
    )

    def walk(seed: int) -> State:
        rng, now = np.random.default_rng(seed), state
        while now.made < 100:
            now, _ = stretch(rng, now, 10)
        return now

    first, other = walk(1), walk(2)
    assert same(first, walk(1)) and not same(first, other)


def test_a_stopped_run_is_repeated_by_stopping_there(rng_seed: int) -> None:
    density = glue()
    asked = iter(range(100))

    def run(stop) -> object:
        return sample(
            np.random.default_rng(rng_seed),
            density,
            LOWER,
            UPPER,
            evaluations=30_000,
            watch=Watchers(stop),
        )

    stopped = run(lambda _: next(asked) >= 20)
    assert stopped.evaluations < 20_000
    again = run(lambda state: state.evaluations >= stopped.evaluations)
    assert np.array_equal(stopped.draws, again.draws)


class Infinite:
    """A record whose sums of squares are made to vanish."""

    def __call__(self, x: Array) -> Array:
        return np.full(len(x), np.inf)

    def compiled(self) -> object:
        return compiled(glue())._replace(size=np.inf)


def test_plus_infinity_is_refused_from_compiled_code_too() -> None:
    state = init(np.random.default_rng(0), glue(), LOWER, UPPER)
    with pytest.raises(InputError, match='plus infinity'):
        stretch(np.random.default_rng(0), state._replace(log_density=Infinite()), 10)


@pytest.mark.parametrize('case', ['glue', 'gaussian', 'sigma'])
def test_only_what_is_hopeless_is_spared_the_exact_kernel(case: str, rng_seed: int) -> None:
    density = CASES[case][0]()
    fast = compiled(density)
    assert fast is not None
    x = np.random.default_rng(rng_seed).uniform(LOWER, UPPER, (200, 4))
    right, inside = density(x), np.zeros(len(x))

    def got(floor: Array) -> Array:
        values = np.empty(len(x))
        log_densities(fast, x, inside, floor, values, scratch(len(fast.rows), len(x)))
        return values

    assert np.array_equal(got(np.full(len(x), -np.inf)), right, equal_nan=True)
    above = got(right - 1.0)
    assert np.array_equal(above, right, equal_nan=True)
    below = got(right + 1e-3 * np.abs(right))
    spared = np.isneginf(below) & np.isfinite(right)
    assert np.array_equal(below[~spared], right[~spared], equal_nan=True)
    # About half of the prior misses the error bound, mostly by little.
    assert spared.mean() > 0.1
