"""How runs of the sampler end, and what cannot be run."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import targets

from actuator_glue.errors import InputError
from actuator_glue.inference.dream import Chains, SamplerSettings, Watchers, sample
from actuator_glue.inference.moves.snooker import SNOOKER
from actuator_glue.records import Array


def test_stop_and_progress() -> None:
    target = targets.scales()
    seen: list[tuple[int, int]] = []

    def run(evaluations: int, stop_at: int) -> Chains:
        return sample(
            np.random.default_rng(1),
            target.log_density,
            target.lower,
            target.upper,
            evaluations=evaluations,
            watch=Watchers(
                stop=lambda state: state.evaluations >= stop_at,
                progress=lambda done, most: seen.append((done, most)),
            ),
        )

    stopped = run(20_000, 12_000)
    assert 12_000 <= stopped.evaluations < 12_000 + SamplerSettings().chains
    assert stopped.evaluations == stopped.start_evaluations + stopped.draws[..., 0].size
    assert seen and all(most == 20_000 for _, most in seen)
    assert [done for done, _ in seen] == sorted(done for done, _ in seen)
    repeated = run(stopped.evaluations, 10**9)
    assert np.array_equal(repeated.draws, stopped.draws)


def test_a_run_ends_where_its_draws_will_do_and_is_the_beginning_of_the_whole_one() -> None:
    target = targets.scales()
    asked: list[int] = []

    def run(answer: Callable[[Chains], bool] | None, evaluations: int = 20_000) -> Chains:
        return sample(
            np.random.default_rng(1),
            target.log_density,
            target.lower,
            target.upper,
            evaluations=evaluations,
            watch=Watchers(enough=answer),
        )

    def asks(chains: Chains) -> bool:
        asked.append(len(chains.draws))
        return False

    whole = run(asks)
    assert asked == [int(part / 16 * len(whole.draws)) for part in range(5, 16)]
    half = run(lambda chains: len(chains.draws) >= len(whole.draws) // 2)
    assert len(half.draws) == asked[3]
    assert np.array_equal(half.draws, whole.draws[: asked[3]])
    assert np.array_equal(whole.draws, run(None).draws)


def test_impossible_regions_and_not_a_number_are_never_entered() -> None:
    def log_density(x: Array) -> Array:
        with np.errstate(invalid='ignore'):
            values = -0.5 * (x**2).sum(axis=1) + 0.0 * np.log(x[:, 0])
        return np.where(x[:, 1] > 1.0, -np.inf, values)

    for start in ('annealed', 'prior'):
        chains = sample(
            np.random.default_rng(0),
            log_density,
            [-5.0, -5.0],
            [5.0, 5.0],
            evaluations=20_000,
            settings=SamplerSettings(start=start),
        )
        draws = chains.posterior()
        assert draws[:, 0].min() >= 0.0
        assert draws[:, 1].max() <= 1.0
        assert np.isfinite(chains.log_density[chains.burn :]).all()


@pytest.mark.parametrize(
    ('lower', 'upper', 'log_density', 'says'),
    [
        ([0.0], [0.0], None, 'lower one first'),
        ([0.0, 0.0], [1.0], None, 'lengths 2 and 1'),
        ([0.0], [np.inf], None, 'finite bounds'),
        ([0.0], [1.0], lambda x: np.full(len(x), np.nan), 'not finite at any'),
        ([0.0], [1.0], lambda x: np.full(len(x), np.inf), 'plus infinity'),
        ([0.0], [1.0], lambda x: np.where(x[:, 0] > 0.9999, np.inf, -x[:, 0]), 'plus infinity'),
        ([0.0], [1.0], lambda x: x, 'shape'),
    ],
)
def test_what_cannot_be_sampled_is_said(lower, upper, log_density, says) -> None:
    with pytest.raises(InputError, match=says):
        sample(
            np.random.default_rng(0),
            log_density or (lambda x: -x[:, 0]),
            lower,
            upper,
            evaluations=100_000,
        )


def test_too_few_evaluations_and_bad_settings_and_archives_are_said() -> None:
    target = targets.scales()
    arguments = (target.log_density, target.lower, target.upper)
    with pytest.raises(InputError, match='used up by the start'):
        sample(np.random.default_rng(0), *arguments, evaluations=100)
    with pytest.raises(InputError, match='outside the prior'):
        sample(np.random.default_rng(0), *arguments, evaluations=9000, archive=np.zeros((5, 4)))
    with pytest.raises(InputError, match='at least two points of 4'):
        sample(np.random.default_rng(0), *arguments, evaluations=9000, archive=np.zeros((5, 3)))
    for wrong in (
        {'chains': 2},
        {'moves': ()},
        {'moves': (SNOOKER,)},
        {'survivors': 0.0},
        {'start': 'there'},
    ):
        with pytest.raises(InputError):
            SamplerSettings(**wrong)


def test_a_budget_that_ends_while_annealing_is_admitted() -> None:
    target = targets.scales()
    chains = sample(
        np.random.default_rng(0), target.log_density, target.lower, target.upper, evaluations=2000
    )
    assert not chains.annealed
    assert chains.evaluations <= 2000
